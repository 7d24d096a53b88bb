# SPDX-License-Identifier: Apache-2.0
"""A node that declares and checks its parameters, and lives on after malformed requests."""

from array import array
from collections.abc import Callable
from typing import Any
from weakref import WeakSet

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterType,
    ParameterValue,
    SetParametersResult,
)
from rcl_interfaces.msg import (
    Parameter as ParameterMessage,
)
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.exceptions import (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterUninitializedException,
)
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.service import Service

from comply_ros.nodes.parameters import (
    KNOWN_NAMES,
    mentor_of_timeout,
    Parameter,
    ParameterError,
    ROS_PARAMETERS,
)
from comply_ros.nodes.ros_start import rclpy_errors
from comply_ros.numerics.number_text import NUMBER
from comply_ros.numerics.similar_name import did_you_mean

PARAMETER_TYPES = {kind.value for kind in RosParameter.Type}


LIVING_NODES: WeakSet['SafeParameterNode'] = WeakSet()  # of this process


class SafeParameterNode(Node):
    """
    A node that declares parameters of the table above, and lives on after malformed requests.

    It warns of parameters on its command line that no node has. Raises ParameterError.

    Attributes
    ----------
    rejected_parameters: names that end the node where they are given, and why.

    """

    rejected_parameters: dict[str, str] = {}

    has_ended = False  # whether the node has nothing more to do, which ends it

    def __init__(self, name: str, **kwargs: Any) -> None:
        self._has_parameters = False
        try:
            with rclpy_errors('the node could not be created: '):
                super().__init__(name, **kwargs)
        except (InvalidParameterTypeException, ParameterUninitializedException) as error:
            given = ((each, self._override(each)) for each in ROS_PARAMETERS
                     if each.name in self._parameter_overrides)
            wrong, value = next(each for each in given if type(each[1]) is not bool)
            raise ParameterError(_type_rule(wrong.name, bool, value)) from error
        LIVING_NODES.add(self)
        self._has_parameters = True
        for name in self._parameter_overrides:
            if name in self.rejected_parameters:
                raise ParameterError(self.rejected_parameters[name])
            prefix, dot, _ = name.partition('.')  # rcl has names with dots, as of QoS overrides
            if mentor_of_timeout(name) is None and name not in KNOWN_NAMES \
                    and (not dot or prefix in KNOWN_NAMES):
                self.get_logger().warning(f'parameter {name!r} is unknown and has no effect'
                                          + did_you_mean(name, KNOWN_NAMES, before='; '))

    def given_parameters(self) -> list[str]:
        """Return the names that were given on the command line or in a file."""
        return list(self._parameter_overrides)

    def declare(self, parameter: Parameter) -> Any:
        """Declare a parameter and return its value; raises ParameterError if it is invalid."""
        try:
            value = self._declare(parameter).value
        except InvalidParameterTypeException:
            raise ParameterError(self._type_rule(parameter)) from None
        except InvalidParameterValueException:
            raise ParameterError(
                f'parameter {parameter.name} must lie in {list(parameter.range or ())}, '
                f'got {self._override(parameter)!r}') from None
        if value is None:
            raise ParameterError(self._type_rule(parameter))
        if parameter.choices and value not in parameter.choices:
            raise ParameterError(did_you_mean(str(value), parameter.choices, after=' ')
                                 + f'parameter {parameter.name} must be one of '
                                 f'{", ".join(parameter.choices)}, got {value!r}')
        return value

    def _declare(self, parameter: Parameter) -> RosParameter:
        """Declare a parameter in rclpy; one that has doubles may be given integers."""
        given = self._override(parameter)
        if type(given) is bool and str(given).lower() in (parameter.choices or ()):
            return self.declare_parameter(parameter.name, str(given).lower(),
                                          descriptor(parameter), ignore_override=True)
        doubles = _as_doubles(parameter.default, given)
        if doubles is not None:
            return self.declare_parameter(parameter.name, doubles, descriptor(parameter),
                                          ignore_override=True)
        return self.declare_parameter(parameter.name, parameter.default, descriptor(parameter))

    def on_parameters_set(self, apply: Callable[[dict[str, Any]], None],
                          validate: Callable[[dict[str, Any]], None] = lambda values: None,
                          ) -> None:
        """
        Let parameters change while the node runs: call `apply` with new values by name.

        validate: called with them before they are set; raises ValueError to reject them.
        """
        def check(parameters: list[RosParameter]) -> SetParametersResult:
            try:
                validate({each.name: _plain(each.value) for each in parameters})
            except ValueError as error:
                return SetParametersResult(successful=False, reason=str(error))
            return SetParametersResult(successful=True)
        self.add_on_set_parameters_callback(check)
        self.add_post_set_parameters_callback(
            lambda parameters: apply({each.name: _plain(each.value) for each in parameters}))

    def create_publisher(self, msg_type: Any, topic: str, qos_profile: Any,
                         **settings: Any) -> Any:
        """Create a publisher; its QoS can be overridden unless `settings` say otherwise."""
        return super().create_publisher(msg_type, topic, qos_profile,
                                        **self._with_overrides(settings))

    def create_subscription(self, msg_type: Any, topic: str, callback: Any, qos_profile: Any,
                            **settings: Any) -> Any:
        """Create a subscription; its QoS can be overridden unless `settings` say otherwise."""
        return super().create_subscription(msg_type, topic, callback, qos_profile,
                                           **self._with_overrides(settings))

    def _with_overrides(self, settings: dict[str, Any]) -> dict[str, Any]:
        if not self._has_parameters:  # rclpy's own topics
            return settings
        return {'qos_overriding_options': QoSOverridingOptions.with_default_policies(), **settings}

    def create_service(self, srv_type: Any, srv_name: str, callback: Callable[..., Any],
                       **settings: Any) -> Service:
        """Create a service; those that set parameters check types before rclpy does."""
        def set_one_by_one(request: Any, response: Any) -> Any:
            rejected = {k: reason for k, each in enumerate(request.parameters)
                        if (reason := self._correct_type(each))}
            request.parameters = [each for k, each in enumerate(request.parameters)
                                  if k not in rejected]
            response.results = callback(request, response).results
            for k, reason in rejected.items():
                response.results.insert(k, SetParametersResult(successful=False, reason=reason))
            return response

        def set_together(request: Any, response: Any) -> Any:
            reasons = [self._correct_type(each) for each in request.parameters]
            if not any(reasons):
                return callback(request, response)
            response.result = SetParametersResult(
                successful=False, reason=next(filter(None, reasons)))
            return response
        setter = {SetParameters: set_one_by_one, SetParametersAtomically: set_together}
        return super().create_service(
            srv_type, srv_name, setter.get(srv_type, callback), **settings)

    def _correct_type(self, given: ParameterMessage) -> str:
        """Make an integer a double where one is wanted; return what is wrong with the type."""
        if given.value.type not in PARAMETER_TYPES:  # it would end rclpy
            return (f'the type of a parameter must be one of {min(PARAMETER_TYPES)} to '
                    f'{max(PARAMETER_TYPES)}, got {given.value.type}')
        if given.value.type == RosParameter.Type.NOT_SET.value or not self.has_parameter(
                given.name):
            return ''
        declared = self.get_parameter(given.name)
        value = parameter_value_to_python(given.value)
        if declared.type_ is RosParameter.Type.DOUBLE and type(value) is int:
            given.value = ParameterValue(
                type=ParameterType.PARAMETER_DOUBLE, double_value=float(value))
        elif given.value.type != declared.type_.value:
            return _type_rule(declared.name, _kind(declared.value), value)
        return ''

    def _type_rule(self, parameter: Parameter) -> str:
        """Sentence about a parameter that was given a value of another type."""
        return _type_rule(parameter.name, _kind(parameter.default), self._override(parameter))

    def _override(self, parameter: Parameter) -> Any:
        """Value that was given on the command line or in a file, None where none was."""
        given = self._parameter_overrides.get(parameter.name)
        if given is None:
            return None
        if given.value is None:  # rclpy takes [] for no value
            return []
        return _plain(given.value)


def destroy_nodes() -> None:
    """
    Destroy the nodes of this process, before rclpy shuts down.

    What rclpy leaves to the end of the interpreter (of several nodes, every second one) would be
    destroyed there in any order, with the middleware gone.
    """
    for node in list(LIVING_NODES):
        LIVING_NODES.discard(node)
        node.destroy_node()


def descriptor(parameter: Parameter) -> ParameterDescriptor:
    """`ParameterDescriptor` with description, range and choices."""
    result = ParameterDescriptor(description=parameter.description, read_only=parameter.read_only)
    if parameter.choices:
        result.additional_constraints = 'one of ' + ', '.join(parameter.choices)
    if parameter.range and isinstance(parameter.default, float):
        low, high = parameter.range
        result.floating_point_range = [FloatingPointRange(
            from_value=float(low), to_value=float(high))]
    elif parameter.range:
        low, high = parameter.range
        result.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
    return result


def _as_doubles(default: Any, given: Any) -> float | list[float] | None:
    """Return integers that were given for a double or for some; None where it is not so."""
    if _kind(default) is float and type(given) is int:
        return float(given)
    numbers = given if isinstance(given, list) else [given]
    if _kind(default) == list[float] and numbers \
            and all(type(each) in (int, float) for each in numbers):
        return [float(each) for each in numbers]
    return None


def _plain(value: Any) -> Any:
    """Return the value of a parameter, of which rclpy makes some lists arrays."""
    return value.tolist() if isinstance(value, array) else value


def _kind(value: Any) -> Any:
    """Type of a value; of a list, with that of its elements."""
    value = _plain(value)
    return list[type(value[0])] if isinstance(value, list) and value else type(value)


def _type_rule(name: str, wanted: Any, value: Any) -> str:
    """Sentence about a value of another type than wanted, with how to write it."""
    rule = {bool: 'true or false', int: 'an integer such as 1', float: 'a double such as 1.0',
            str: 'a string', list[str]: 'a list of strings such as [state, action]',
            list[int]: 'a list of integers such as [40, 40]',
            list[float]: 'a list of doubles such as [0.5, 2.0]'}[wanted]
    if wanted is str and isinstance(value, bool | int | float):
        rule += ' (in quotes, as it looks like something else)'
    elif wanted is not str and isinstance(value, str) and (
            NUMBER.fullmatch(value) or value in ('true', 'false')):
        rule += ' (without quotes)'
    elif wanted is int and isinstance(value, float) and value.is_integer():
        rule += ' (without a point)'
    return f'parameter {name} must be {rule}, got {value!r}'
