# SPDX-License-Identifier: Apache-2.0
"""The parameters of another node: which it has, what they are now, and to set one."""

from typing import NamedTuple

from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python

from comply_ros.dashboard.service_client import NoAnswerError


class RemoteParameter(NamedTuple):
    """A parameter as it is now, and whether it may change while its node runs."""

    value: object
    changes: bool


class RemoteParameters:
    """
    Parameters of one node, as it told them and as it tells that they change.

    Parameters
    ----------
    node: its name.
    names: of the parameters.

    Attributes
    ----------
    now: table of `RemoteParameter` by name, empty before the node told; always a new one.

    """

    def __init__(self, node, names):
        self.node, self.names, self.now = node, list(names), {}
        self._values, self._asked = {}, ()

    def services(self):
        """Pairs (type, name) of the services that are asked for."""
        return [(kind, f'{self.node}/{name}') for kind, name in (
            (GetParameters, 'get_parameters'), (DescribeParameters, 'describe_parameters'),
            (SetParameters, 'set_parameters'))]

    def backup(self, asking):
        """Begin to ask for all of them, in the thread of ROS."""
        self._asked = (
            asking.begin(f'{self.node}/get_parameters', GetParameters.Request(names=self.names)),
            asking.begin(f'{self.node}/describe_parameters',
                         DescribeParameters.Request(names=self.names)))

    def look(self):
        """Take what was answered; return whether everything that was asked for is known."""
        if not all(each.done() for each in self._asked):
            return False
        asked, self._asked = self._asked, ()
        if not asked:
            return bool(self.now)
        if any(each.exception() for each in asked):
            return False
        values, described = (each.result() for each in asked)
        self.now = {
            about.name: RemoteParameter(parameter_value_to_python(value), not about.read_only)
            for about, value in zip(described.descriptors, values.values)}
        return bool(self.now)

    def hear(self, changed):
        """Take parameters that a `ParameterEvent` tells of."""
        news = {each.name: RemoteParameter(parameter_value_to_python(each.value), True)
                for each in changed if each.name in self.now}
        self.now = {**self.now, **news}

    async def set(self, asking, name, value):
        """
        Change one parameter of the node; for the thread of the page.

        Raises
        ------
        NoAnswerError: if the node does not answer, or refuses: with what it says.

        """
        answer = await asking.ask(f'{self.node}/set_parameters', SetParameters.Request(
            parameters=[RosParameter(name, value=value).to_parameter_msg()]))
        if not answer.results[0].successful:
            raise NoAnswerError(answer.results[0].reason or f'{self.node} refused {name}')
