# SPDX-License-Identifier: Apache-2.0
"""A node that says garbage on every topic and calls every service with it, for tests."""

from collections import Counter
import time

from comply_msgs.srv import Recommend, Save
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from hypothesis import strategies as st
from message_strategies import GARBAGE, naturals, numbers, policies, texts, trusts
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from waiting import DEADLINE

from comply_ros.nodes import topics
from comply_ros.nodes.diagnostics import process_name, TOPIC

DIAGNOSTICS = topics.Topic(TOPIC, DiagnosticArray, None, QoSProfile(depth=10))
LIVE = (topics.STATE, topics.RECOMMENDATION, topics.ACTION, topics.WORLD, topics.EPISODE,
        topics.PROGRESS, topics.TRUST, topics.POLICY, topics.MENTOR_POLICY)
NODES = 'grid_world', 'mentor', 'learner'
KEPT = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # none is lost
ACKNOWLEDGED = Duration(seconds=10.0)
kinds = {topic.name: GARBAGE.get(topic.tuple_type, policies) for topic in LIVE} | {'trust': trusts}
statuses = st.builds(
    lambda level, name, message, value: lambda pids: DiagnosticArray(status=[DiagnosticStatus(
        level=bytes([level]), name=f'of nobody {name}', message=message,
        hardware_id=process_name(pids[level % len(pids)]),
        values=[KeyValue(key=message[:99], value=value[:99])])]),
    st.integers(0, 255), texts, texts, texts)
rubbish = st.one_of(*[st.tuples(st.just(topic), kinds[topic.name]) for topic in LIVE],
                    statuses.map(lambda make: (DIAGNOSTICS, make)))
values = st.one_of(  # what would be right is left out: whoever may set the rate may set it
    st.builds(ParameterValue, type=st.integers(0, 255).filter(lambda kind: kind not in (1, 3)),
              string_value=texts, integer_value=st.integers(-2 ** 63, 2 ** 63 - 1)),
    st.builds(ParameterValue, type=st.just(3), double_value=numbers.filter(
        lambda number: not 0.0 <= number <= 1000.0)))
settings = st.lists(st.builds(Parameter, name=st.one_of(st.sampled_from(
    ['rate', 'seed', 'use_sim_time', 'temperature', 'state_dir']), texts), value=values),
    max_size=3)
paths = st.sampled_from(['', '/', '/nowhere/x', '~nobody-at-all/x', 'x' * 100_000, '/dev/null/x'])
requests = st.one_of(
    st.tuples(st.just((Recommend, 'recommend')), st.fixed_dictionaries({'state': naturals})),
    st.tuples(st.just((Save, 'save')), st.fixed_dictionaries({'path': paths})),
    *[st.tuples(st.just((kind, f'{node}/{name}')), request) for node in NODES
      for kind, name, request in (
          (SetParameters, 'set_parameters', st.fixed_dictionaries({'parameters': settings})),
          (SetParametersAtomically, 'set_parameters_atomically',
           st.fixed_dictionaries({'parameters': settings})),
          (ListParameters, 'list_parameters', st.fixed_dictionaries(
              {'prefixes': st.lists(texts, max_size=3), 'depth': st.integers(0, 2 ** 64 - 1)})),
          (GetParameters, 'get_parameters', st.fixed_dictionaries(
              {'names': st.lists(texts, max_size=3)})),
          (DescribeParameters, 'describe_parameters', st.fixed_dictionaries(
              {'names': st.lists(texts, max_size=3)})))])


class Flood:
    """
    Says garbage that is made of what it hears, and waits until all of it is delivered.

    Attributes
    ----------
    latest: the last true tuple on each topic.
    count: messages delivered so far, by name of the topic.
    asked: futures of the services that were called.
    told: table of the last diagnosis of each node.

    """

    def __init__(self, context, pids):
        self._node, self._pids = Node('flood', context=context), pids
        self._executor = rclpy.executors.SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self.latest, self.count, self.asked, self.told = {}, Counter(), [], {}
        self._said, self._clients, self._ears, self._deaf = set(), {}, {}, set()
        self._publishers = {topic.name: self._node.create_publisher(
            topic.message, topic.name, KEPT) for topic in (*LIVE, DIAGNOSTICS)}
        self._encoders = {topic.name: topics.encoder(topic) for topic in LIVE}
        for topic in LIVE:
            self._listen(topic)
        self._node.create_subscription(DiagnosticArray, TOPIC, self._on_diagnostics, 1000)

    def _listen(self, topic):
        decode = topics.decoder(topic)
        self._ears[topic.name] = self._node.create_subscription(
            topic.message, topic.name, lambda message: self._hear(topic, decode(message)),
            topic.qos)

    def _hear(self, topic, msg):
        if _short(msg) in self._said:
            return  # of this node
        self.latest[topic.name] = msg
        if topic in (topics.WORLD, topics.TRUST, topics.POLICY, topics.MENTOR_POLICY):
            self._deaf.add(topic.name)  # this does not change, and what comes now is garbage

    def _on_diagnostics(self, msg):
        for status in msg.status:
            if not status.name.startswith('of nobody'):
                self.told[status.name] = {each.key: each.value for each in status.values}

    def spin_until(self, condition, what, deadline=DEADLINE):
        """Hear what is said until the condition is true; fail after the deadline."""
        end = time.monotonic() + deadline
        while not condition():
            assert time.monotonic() < end, f'no {what} within {deadline} s'
            self._executor.spin_once(timeout_sec=0.05)

    def steps(self):
        """Return how many questions the world has asked by now."""
        self.told.clear()
        self.spin_until(lambda: 'grid_world' in self.told, 'diagnosis of the world')
        return int(self.told['grid_world']['steps'])

    def say(self, handful):
        """Say garbage, and hear what is true now."""
        while self._deaf:
            self._node.destroy_subscription(self._ears.pop(self._deaf.pop()))
        for topic, spoil in handful:
            self._say(topic, spoil)
            self._executor.spin_once(timeout_sec=0.0)

    def wait(self):
        """Return when all that was said has arrived."""
        for publisher in self._publishers.values():
            assert publisher.wait_for_all_acked(ACKNOWLEDGED)

    def _say(self, topic, spoil):
        if topic is DIAGNOSTICS:
            message = spoil(self._pids)
        elif topic.name in self.latest:
            msg = spoil(self.latest[topic.name])
            self._said.add(_short(msg))
            message = self._encoders[topic.name](msg)
        else:
            return
        self._publishers[topic.name].publish(message)
        self.count[topic.name] += 1

    def set_rate(self, rate):
        """Set the rate of the world, as anybody may; raises nothing where it is refused."""
        self.ask((SetParameters, 'grid_world/set_parameters'), {'parameters': [Parameter(
            name='rate', value=ParameterValue(type=3, double_value=rate))]})
        self.spin_until(self.asked[-1].done, 'answer')
        assert self.asked[-1].result().results[0].successful

    def ask(self, service, request):
        """Call a service with garbage; its future is among those that were `asked`."""
        kind, name = service
        if service not in self._clients:
            self._clients[service] = self._node.create_client(kind, name)
        client = self._clients[service]
        if client.service_is_ready():
            self.asked.append(client.call_async(kind.Request(**request)))


def _short(msg):
    """Return what tells a tuple from another one, without its arrays."""
    return type(msg), *(len(each) if hasattr(each, '__len__') else repr(each) for each in msg)
