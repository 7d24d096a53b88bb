# SPDX-License-Identifier: Apache-2.0
"""A node of a test that calls services, sets parameters and hears how others are."""

from contextlib import contextmanager
import time

from diagnostic_msgs.msg import DiagnosticArray
from node_processes import DEADLINE
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import SetBool, Trigger

from comply_ros.nodes.topics import decoder

AGAIN = 2.0  # seconds before a question about parameters is asked again


class Caller(Node):
    """
    Calls, and waits for what comes back.

    Attributes
    ----------
    words: what each node says of itself, by name.
    heard: what was said, by topic name.

    """

    def __init__(self, context):
        super().__init__('caller', context=context)
        self.words, self.heard, self._called = {}, {}, 0.0
        self.executor_ = rclpy.executors.SingleThreadedExecutor(context=context)
        self.executor_.add_node(self)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)

    def listen(self, *topics):
        """Keep what is said on topics from now on."""
        for topic in topics:
            heard, decode = self.heard.setdefault(topic.name, []), decoder(topic)
            self.create_subscription(
                topic.message, topic.name,
                lambda message, heard=heard, decode=decode: heard.append(decode(message)),
                topic.qos)

    def until(self, condition, what, deadline=DEADLINE):
        """Spin until the condition is true; return what it returned; fail after the deadline."""
        end = time.monotonic() + deadline
        while time.monotonic() < end:
            value = condition()
            if value:
                return value
            self.executor_.spin_once(timeout_sec=0.02)
        raise AssertionError(f'no {what} within {deadline} s')

    def call(self, kind, name, **request):
        """Return the response of a service."""
        client = self.create_client(kind, name)
        self.until(client.service_is_ready, name)
        future = client.call_async(kind.Request(**request))
        self.until(future.done, f'answer of {name}')
        self.destroy_client(client)
        return future.result()

    def pause(self, wanted=True):
        """Pause the world, or let it go on."""
        return self.call(SetBool, 'grid_world/pause', data=wanted)

    def trigger(self, name):
        """Return the response of a service without arguments."""
        return self.call(Trigger, name)

    def set(self, node, **values):
        """Return the reason why parameters of a node could not be set; empty where they are."""
        client = AsyncParameterClient(self, node)
        given = [Parameter(name, value=value) for name, value in values.items()]
        results = self._ask(client, lambda: client.set_parameters(given)).results
        return '; '.join(each.reason for each in results if not each.successful)

    def get(self, node, name):
        """Return the value of a parameter of a node."""
        client = AsyncParameterClient(self, node)
        value, = self._ask(client, lambda: client.get_parameters([name])).values
        return rclpy.parameter.parameter_value_to_python(value)

    def _ask(self, client, call):
        """Return the response to a call that may be repeated: a killed node gives none."""
        self.until(client.services_are_ready, 'parameters')
        calls = []

        def answered():
            if not calls or time.monotonic() > self._called + AGAIN:
                self._called = time.monotonic()
                calls.append(call())
            return [each for each in calls if each.done()]
        return self.until(answered, 'answer')[0].result()

    def _on_diagnostics(self, message):
        for status in message.status:
            self.words[status.name] = status.message


@contextmanager
def caller():
    """Give a `Caller` in a context of its own."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = Caller(context)
    try:
        yield node
    finally:
        node.executor_.remove_node(node)
        node.destroy_node()
        rclpy.try_shutdown(context=context)
