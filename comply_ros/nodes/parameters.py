# SPDX-License-Identifier: Apache-2.0
"""The parameters of all nodes in one table, and a node that declares and checks them."""

from collections.abc import Callable
from dataclasses import fields
from typing import Any, NamedTuple
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

from comply_ros.learner.learner_config import CONFIG_FIELDS, LearnerConfig
from comply_ros.learner.presets import METHODS
from comply_ros.mentor.advice_budget import ADVISING_MODES, UNLIMITED
from comply_ros.nodes.ros_start import rclpy_errors
from comply_ros.numerics.number_text import NUMBER
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.protocol.channel_faults import Faults


class ParameterError(ValueError):
    """A parameter with an invalid value; the message names it, the rule and the value."""


class Parameter(NamedTuple):
    """One parameter of a node: name, default, description, and which values are valid."""

    name: str
    default: Any
    description: str
    range: tuple[float, float] | None = None
    choices: tuple[str, ...] | None = None
    read_only: bool = True  # else it may be set while the node runs


def config_parameters(config: LearnerConfig) -> list[Parameter]:
    """Parameters of the learner for every field of `LearnerConfig`; defaults from `config`."""
    return [_from_metadata(name, getattr(config, name), field.metadata, read_only=False)
            for name, field in CONFIG_FIELDS.items()]


def _from_metadata(name, default, metadata, read_only):
    low, high = metadata['low'], metadata['high']
    return Parameter(name, default, metadata['text'], None if low is None else (low, high),
                     metadata.get('choices'), read_only)


MAP = Parameter('map', 'maze', 'Name of a map of this package, or path of a map file')
PROFILE = Parameter(
    'profile', 'published', 'Settings of the text of the report, or of the runs behind its '
    'figures', choices=tuple(METHODS))
SEED = Parameter('seed', 0, 'Seed of the random numbers', (0, SEED_LIMIT))
SLOWEST, FASTEST = 0.001, 1000  # steps per second that a world can be slowed down to
RATE = Parameter(
    'rate', 0.0, 'Steps per second; 0: as fast as possible', (0, FASTEST), read_only=False)
METHOD = Parameter(
    'method', 'beta_implicit', 'Learning method; sets the defaults of the parameters below',
    choices=tuple(METHODS['published']))
MENTOR = Parameter(
    'mentor', 'snapshot:0.75', 'optimal, random, adversarial, noisy:P, snapshot:Q, file:PATH, '
    'learned:FILE.npz (what a learner has learned and saved) or none; with @C behind it, advice '
    'in a share C of the states only')
BUDGET = Parameter(
    'budget', UNLIMITED, 'Recommendations that the mentor may give; 0: no limit',
    (0, 1_000_000_000))
ADVISING = Parameter(
    'advising', 'early', 'With a budget, when the mentor spends it: in the first states, where '
    'much depends on the action, or where the learner did something else the last time (then the '
    'learner needs remembers_advice false)', choices=ADVISING_MODES)
MENTOR_SEED = Parameter('seed', 0, 'Which one of the mentors of this kind', (0, SEED_LIMIT))
MAP_PERIOD = Parameter(
    'map_period', 1.0, 'Seconds between two maps over all states, at least; never less than 60 '
    'times what the last ones took', (0, 3600))
REMEMBERS_ADVICE = Parameter(
    'remembers_advice', True, 'In a state with earlier advice, act on it at once; newer advice '
    'there counts from the next visit on', read_only=False)
ADVICE_TIMEOUT = Parameter(
    'advice_timeout', 0.0, 'Seconds to wait for advice in a state before going on without it; 0: '
    'no limit', (0, 3600), read_only=False)
PATIENCE = Parameter(
    'patience', 1.0, 'While a person steers: seconds that an observation waits for the person, '
    'before the recommendation is no advice', (0.05, 3600), read_only=False)
POLICY_FILE = Parameter(
    'policy_file', 'policy.txt', 'File to which a human mentor saves the policy')
INITIAL_LEARNING = Parameter(
    'initial_learning', '', 'File that a learner has saved (learning.npz), of the same world: '
    'begin with its values and beliefs. It is no checkpoint: schedules, counts and random numbers '
    'begin anew. A checkpoint in state_dir counts more; empty: begin with nothing')
END_WHEN_FINISHED = Parameter(
    'end_when_finished', False, 'Whether the learner ends, with exit code 0, when it has learned '
    'its last iteration; else it stays, and what it learned can be asked for and saved')
STATE_DIR = Parameter(
    'state_dir', '', 'Folder for the checkpoint and journal with which the node goes on after a '
    'kill as if nothing had happened; empty: nothing is stored')
BAG = Parameter(
    'bag', '', 'Folder of the bag to write, which must not exist yet; empty: named after the '
    'time, in runs/')
RECORDED = Parameter(
    'topics', ['view/*'], 'Topics to record besides those of the conversation: names, or patterns '
    'such as view/*')
TOPICS = Parameter(
    'topics', ['state', 'recommendation', 'action'], 'Topics to relay: messages on NAME/before '
    'are published on NAME')
DEPTH = Parameter(
    'depth', 1, 'Messages of a latched topic that late subscribers receive: the depth of the '
    'relayed publisher, which discovery does not tell', (1, 100_000))
FRAME = Parameter('frame', 'map', 'Coordinate frame of everything that the viewer publishes')
ROBOT_FRAME = Parameter(
    'robot_frame', 'robot', 'Coordinate frame of the robot, published on /tf where tf2_msgs is '
    'installed; empty: not published')
CELL_SIZE = Parameter('cell_size', 1.0, 'Side of a cell, in metres', (0.001, 1000))
ROBOT_RATE = Parameter(
    'robot_rate', 10.0, 'How often per second robot, trail and returns are published, if they '
    'changed', (0.01, 100))
MAP_RATE = Parameter(
    'map_rate', 1.0, 'How often per second maps and arrows are published, if they changed',
    (0.01, 100))
TRAIL_LENGTH = Parameter(
    'trail_length', 1000, 'Points of the trail of an episode, at most', (1, 100_000))
ADDRESS = Parameter(
    'address', 'localhost', 'Address that the page is served on; one that other machines reach, '
    'such as 0.0.0.0, requires the token')
PORT = Parameter('port', 8080, 'Port that the page is served on; 0: any free one', (0, 65535))
TOKEN_FILE = Parameter(
    'token_file', '', 'File, of mode 600, with the token that a browser has to present before it '
    'sees the page; it is created if it does not exist. The environment variable COMPLY_ROS_TOKEN '
    'counts more. Empty: no token on localhost, elsewhere one is made and printed on the terminal')
TEACH = Parameter(
    'teach', 'auto', 'Whether a person teaches on the page, as the node mentor: true, false (the '
    'page only watches) or auto (it watches while another mentor is heard, and offers to take '
    'over)', choices=('auto', 'true', 'false'))
FAULTS = tuple(_from_metadata(field.name, field.default, field.metadata, read_only=True)
               for field in fields(Faults))
ROS_PARAMETERS = (  # of every node, declared by rclpy
    Parameter('use_sim_time', False, 'Follow the topic /clock', read_only=False),
    Parameter('start_type_description_service', True, 'Serve the definitions of types'))
KNOWN_NAMES = {each.name for each in (*globals().values(), *FAULTS, *ROS_PARAMETERS)
               if isinstance(each, Parameter)} | set(CONFIG_FIELDS)
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
            if name not in KNOWN_NAMES and (not dot or prefix in KNOWN_NAMES):
                self.get_logger().warning(f'parameter {name!r} is unknown and has no effect')

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
            raise ParameterError(f'parameter {parameter.name} must be one of '
                                 f'{", ".join(parameter.choices)}, got {value!r}')
        return value

    def _declare(self, parameter: Parameter) -> RosParameter:
        """Declare a parameter in rclpy; one that is a double may be given as an integer."""
        given = self._override(parameter)
        if type(given) is bool and str(given).lower() in (parameter.choices or ()):
            return self.declare_parameter(parameter.name, str(given).lower(),
                                          descriptor(parameter), ignore_override=True)
        if type(parameter.default) is float and type(given) is int:
            return self.declare_parameter(parameter.name, float(given), descriptor(parameter),
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
                validate({each.name: each.value for each in parameters})
            except ValueError as error:
                return SetParametersResult(successful=False, reason=str(error))
            return SetParametersResult(successful=True)
        self.add_on_set_parameters_callback(check)
        self.add_post_set_parameters_callback(
            lambda parameters: apply({each.name: each.value for each in parameters}))

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
            return _type_rule(declared.name, type(declared.value), value)
        return ''

    def _type_rule(self, parameter: Parameter) -> str:
        """Sentence about a parameter that was given a value of another type."""
        return _type_rule(parameter.name, type(parameter.default), self._override(parameter))

    def _override(self, parameter: Parameter) -> Any:
        """Value that was given on the command line or in a file, None where none was."""
        given = self._parameter_overrides.get(parameter.name)
        if given is None:
            return None
        return [] if given.value is None else given.value  # rclpy takes [] for no value


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


def _type_rule(name: str, wanted: type, value: Any) -> str:
    """Sentence about a value of another type than wanted, with how to write it."""
    rule = {bool: 'true or false', int: 'an integer such as 1', float: 'a double such as 1.0',
            str: 'a string', list: 'a list of strings such as [state, action]'}[wanted]
    if wanted is str and isinstance(value, bool | int | float):
        rule += ' (in quotes, as it looks like something else)'
    elif wanted is not str and isinstance(value, str) and (
            NUMBER.fullmatch(value) or value in ('true', 'false')):
        rule += ' (without quotes)'
    elif wanted is int and isinstance(value, float) and value.is_integer():
        rule += ' (without a point)'
    return f'parameter {name} must be {rule}, got {value!r}'
