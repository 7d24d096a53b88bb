# SPDX-License-Identifier: Apache-2.0
"""A node of a test: it calls services, sets parameters and receives messages."""

from collections import defaultdict
from collections.abc import Callable, Generator
from contextlib import contextmanager
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import SetBool, Trigger
from waiting import DEADLINE

from comply_ros.nodes.topics import decoder, Topic

RETRY_PERIOD = 2.0  # seconds after which a call for parameters is repeated


class RosClient(Node):
    """
    Calls services and waits for the responses.

    Attributes
    ----------
    statuses: the last status message of each node on `/diagnostics`, by name.
    health: all that each node has published on `/diagnostics`, by name.
    received: the messages of each topic, by name.

    """

    def __init__(self, context: rclpy.Context) -> None:
        super().__init__('ros_client', context=context)
        self.statuses: dict[str, str] = {}
        self.health: defaultdict[str, list[DiagnosticStatus]] = defaultdict(list)
        self.received: dict[str, list[Any]] = {}
        self._called = 0.0
        self.executor_ = rclpy.executors.SingleThreadedExecutor(context=context)
        self.executor_.add_node(self)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)

    def subscribe(self, *topics: Topic) -> None:
        """Record the messages on topics from now on."""
        for topic in topics:
            received, decode = self.received.setdefault(topic.name, []), decoder(topic)
            self.create_subscription(
                topic.message, topic.name,
                lambda msg, received=received, decode=decode: received.append(decode(msg)),
                topic.qos)

    def until(self, condition: Callable[[], Any], what: str, deadline: float = DEADLINE) -> Any:
        """Spin until the condition is true; return what it returned; fail after the deadline."""
        end = time.monotonic() + deadline
        while time.monotonic() < end:
            value = condition()
            if value:
                return value
            self.executor_.spin_once(timeout_sec=0.02)
        raise AssertionError(f'no {what} within {deadline} s')

    def call(self, kind: Any, name: str, **request: Any) -> Any:
        """Return the response of a service."""
        client = self.create_client(kind, name)
        self.until(client.service_is_ready, name)
        future = client.call_async(kind.Request(**request))
        self.until(future.done, f'response of {name}')
        self.destroy_client(client)
        return future.result()

    def pause(self, paused: bool = True) -> SetBool.Response:
        """Pause the world, or resume it."""
        return self.call(SetBool, 'grid_world/pause', data=paused)

    def trigger(self, name: str) -> Trigger.Response:
        """Return the response of a service without arguments."""
        return self.call(Trigger, name)

    def set(self, node: str, **values: Any) -> str:
        """Return the reason why parameters of a node could not be set; empty where they are."""
        client = AsyncParameterClient(self, node)
        given = [Parameter(name, value=value) for name, value in values.items()]
        results = self._call_parameters(client, lambda: client.set_parameters(given)).results
        return '; '.join(each.reason for each in results if not each.successful)

    def get(self, node: str, name: str) -> Any:
        """Return the value of a parameter of a node."""
        client = AsyncParameterClient(self, node)
        value, = self._call_parameters(client, lambda: client.get_parameters([name])).values
        return rclpy.parameter.parameter_value_to_python(value)

    def steps(self, node: str) -> int:
        """Return the steps that a node has last reported on `/diagnostics`; 0 before it did."""
        values = self.health[node][-1].values if self.health[node] else ()
        return next((int(each.value) for each in values if each.key == 'steps'), 0)

    def _call_parameters(self, client: AsyncParameterClient, call: Callable[[], Any]) -> Any:
        """Return the response to a call, which is repeated: a killed node does not respond."""
        self.until(client.services_are_ready, 'parameters')
        calls = []

        def finished() -> list[Any]:
            if not calls or time.monotonic() > self._called + RETRY_PERIOD:
                self._called = time.monotonic()
                calls.append(call())
            return [each for each in calls if each.done()]
        return self.until(finished, 'response')[0].result()

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        for status in msg.status:
            self.statuses[status.name] = status.message
            self.health[status.name].append(status)


@contextmanager
def ros_client() -> Generator[RosClient]:
    """Give a `RosClient` in a context of its own."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = RosClient(context)
    try:
        yield node
    finally:
        node.executor_.remove_node(node)
        node.destroy_node()
        rclpy.try_shutdown(context=context)
