# SPDX-License-Identifier: Apache-2.0
"""The parameters of another node: their values, whether they can change, and how to set them."""

from collections.abc import Iterable
from concurrent.futures import Future
from typing import Any, NamedTuple

from rcl_interfaces.msg import Parameter as ParameterMsg
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python

from comply_ros.dashboard.service_client import ServiceCallError, ServiceClient

READERS = {'get_parameters': GetParameters, 'describe_parameters': DescribeParameters}


class RemoteParameter(NamedTuple):
    """The value of a parameter, and whether it can change while its node runs."""

    value: Any
    can_change: bool


class RemoteParameters:
    """Parameters of one node: read by services at first, then kept up to date by its events."""

    def __init__(self, node_name: str, names: Iterable[str], client: ServiceClient) -> None:
        self.node_name, self._names, self._client = node_name, list(names), client
        self.current: dict[str, RemoteParameter] = {}  # never changed in place; empty: unknown
        self._n_asked, self._n_read = 0, 0  # of the names
        self._answers: tuple[Future, ...] = ()  # of the `READERS`
        for name, service_type in {**READERS, 'set_parameters': SetParameters}.items():
            client.add(service_type, f'{node_name}/{name}')

    def tick(self) -> None:
        """Take what the node has answered, once a second; ask again while nothing is known."""
        answers, self._answers = self._answers, ()
        if answers and all(each.done() and not each.exception() for each in answers):
            values, descriptions = (each.result() for each in answers)
            self.current = {
                each.name: RemoteParameter(parameter_value_to_python(value), not each.read_only)
                for each, value in zip(descriptions.descriptors, values.values)
                if value.type != ParameterType.PARAMETER_NOT_SET}  # such as of a world of others
            self._n_read = self._n_asked
        if not self.current or self._n_read < len(self._names):
            self._n_asked = len(self._names)
            self._answers = tuple(
                self._client.send(f'{self.node_name}/{name}', kind.Request(names=self._names))
                for name, kind in READERS.items())

    def read_also(self, names: Iterable[str]) -> None:
        """Read these parameters too, which the node may have declared while it ran."""
        self._names += [name for name in names if name not in self._names]

    def on_change(self, changed: Iterable[ParameterMsg]) -> None:
        """Take the parameters of a `ParameterEvent`; those that are not known are ignored."""
        self.current = {**self.current, **{
            each.name: RemoteParameter(parameter_value_to_python(each.value), True)
            for each in changed if each.name in self.current}}

    async def set(self, name: str, value: Any) -> None:
        """Set one parameter, for the page; raises ServiceCallError with the node's reason."""
        response = await self._client.call(
            f'{self.node_name}/set_parameters', SetParameters.Request(
                parameters=[RosParameter(name, value=value).to_parameter_msg()]))
        result, = response.results
        if not result.successful:
            raise ServiceCallError(
                result.reason or f'{self.node_name} has rejected {name}: {value!r}')
