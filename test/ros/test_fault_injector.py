# SPDX-License-Identifier: Apache-2.0
"""The fault injector as a real process between a publisher and a subscriber."""

import re
import time

from comply_msgs.msg import Action, Episode, WorldDescription
from node_processes import log_has, nodes, run
import pytest
from rcl_interfaces.msg import Log
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from waiting import DEADLINE, wait_until

from comply_ros.nodes.fault_injector import message_type, TopicError

pytestmark = pytest.mark.usefixtures('domain')
ONE = ('-p', 'topics:=[out]')
LATCHED = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LAST = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def make_node():
    """Return a function that makes a node of the test's own."""
    contexts = []

    def make(name):
        contexts.append(rclpy.Context())
        rclpy.init(context=contexts[-1])
        return Node(name, context=contexts[-1])
    yield make
    for context in contexts:
        rclpy.try_shutdown(context=context)


@pytest.fixture
def node(make_node):
    """Return a node of the test's own."""
    return make_node('test')


@pytest.fixture
def spin_until(node):
    """Return a function that spins the test's node until a condition is true."""
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)

    def spin(condition, what, deadline=DEADLINE):
        end = time.monotonic() + deadline
        while not condition():
            assert time.monotonic() < end, f'no {what} within {deadline} s'
            executor.spin_once(timeout_sec=0.05)
    return spin


def received(node, kind, name, qos):
    """Return the list of messages on a topic from now on."""
    messages = []
    node.create_subscription(kind, name, messages.append, qos)
    return messages


def wait_for_relay(started, name='out'):
    """Wait until a topic is relayed."""
    wait_until(log_has(started['fault_injector'], f'relays {name} ('), 'relay')


def summary(started, name='out'):
    """End the fault injector; return what it counted, by name."""
    process = started['fault_injector']
    process.interrupt()
    assert process.wait() == 0
    lines = re.findall(rf'\[fault_injector\]: {name}: (.*)', process.log.read_text())
    assert len(lines) == 1
    return {what: int(count) for count, what in (each.split() for each in lines[0].split(', '))}


def test_messages_of_any_type_are_relayed_whole_and_in_order(tmp_path, node, spin_until):
    world = WorldDescription(run=7, name='é', rows=['..', '#G'], starts=[0, 2])
    episodes = [Episode(run=7, episode=number, total_reward=number / 3) for number in range(300)]
    logs = [Log(level=20, name='x' * length, msg='m') for length in range(30)]
    cases = (('one', [world]), ('two', episodes), ('three', logs))
    results = {}
    for name, messages in cases:
        publisher = node.create_publisher(type(messages[0]), f'{name}/before', LATCHED)
        results[name] = received(node, type(messages[0]), name, LATCHED)
        for message in messages:
            publisher.publish(message)
    with nodes(tmp_path, fault_injector=('-p', 'topics:=[one, two, three]', '-p',
                                         'depth:=1000')) as started:
        spin_until(lambda: all(len(results[name]) == len(sent) for name, sent in cases),
                   'all messages')
        assert results == dict(cases)
        assert summary(started, 'two') == {
            'heard': 300, 'dropped': 0, 'delayed': 0, 'duplicated': 0, 'reordered': 0,
            'relayed': 300}


def test_topics_of_a_pattern_are_relayed_when_they_are_found(tmp_path, node, spin_until):
    any_mentor = ('-p', 'topics:=["mentors/*/out"]')
    with nodes(tmp_path, fault_injector=any_mentor) as started:
        for name in ('anna', 'bob'):
            relayed = received(node, Episode, f'mentors/{name}/out', LATCHED)
            publisher = node.create_publisher(Episode, f'mentors/{name}/out/before', LAST)
            publisher.publish(Episode(run=7))
            spin_until(lambda: len(relayed) == 1, 'relayed message')
        other = node.create_publisher(Episode, 'mentors/a/b/out/before', LAST)
        node.create_publisher(Episode, 'mentors/carl/out/before', LAST)
        wait_for_relay(started, '/mentors/carl/out')
        assert 'relays /mentors/a/b' not in started['fault_injector'].log.read_text()
        node.destroy_publisher(other)
        assert summary(started, '/mentors/bob/out')['relayed'] == 1


def test_a_late_subscriber_receives_the_last_message_and_no_older_one(tmp_path, node, spin_until):
    publisher = node.create_publisher(Episode, 'out/before', LAST)
    early = received(node, Episode, 'out', LATCHED)
    with nodes(tmp_path, fault_injector=ONE) as started:
        wait_for_relay(started)
        for number in range(50):
            publisher.publish(Episode(episode=number))
            spin_until(lambda: len(early) == number + 1, 'message')
        late = received(node, Episode, 'out', LATCHED)
        publisher.publish(Episode(episode=50))
        spin_until(lambda: late and late[-1].episode == 50, 'new message')
        assert [each.episode for each in late] in ([49, 50], [50])
        again = received(node, Episode, 'out', LATCHED)
        spin_until(lambda: again, 'last message')
        assert [each.episode for each in again] == [50]


def test_a_best_effort_volatile_topic_is_relayed_as_that(tmp_path, node, spin_until):
    offered = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    node.create_publisher(Episode, 'out/before', offered)
    with nodes(tmp_path, fault_injector=ONE) as started:
        wait_for_relay(started)
        spin_until(lambda: node.get_publishers_info_by_topic('/out'), 'publisher')
        qos = node.get_publishers_info_by_topic('/out')[0].qos_profile
        assert (qos.reliability, qos.durability) == (
            ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy.VOLATILE)


@pytest.mark.long
def test_with_drop_1_nothing_is_published(tmp_path, node, spin_until):
    publisher = node.create_publisher(Episode, 'lost/before', LATCHED)
    control = node.create_publisher(Episode, 'out/before', LATCHED)
    lost, messages = (received(node, Episode, name, LATCHED) for name in ('lost', 'out'))
    with nodes(tmp_path / 'lost', fault_injector=(
            '-r', '__node:=losing', '-p', 'topics:=[lost]', '-p', 'drop:=1.0')) as losing, \
            nodes(tmp_path / 'out', fault_injector=ONE) as control_injector:
        wait_for_relay(losing, 'lost')
        wait_for_relay(control_injector)
        for number in range(20):
            publisher.publish(Episode(episode=number))
            control.publish(Episode(episode=number))
            spin_until(lambda: len(messages) == number + 1, 'message of the control')
        assert lost == []
    text = losing['fault_injector'].log.read_text()
    assert 'lost: 20 heard, 20 dropped, 0 delayed, 0 duplicated, 0 reordered, 0 relayed' in text


def test_late_and_reordered_messages_all_arrive(tmp_path, node, spin_until):
    publisher = node.create_publisher(Episode, 'out/before', LATCHED)
    messages = received(node, Episode, 'out', LATCHED)
    with nodes(tmp_path, fault_injector=(
            *ONE, '-p', 'delay:=0.5', '-p', 'reorder:=0.5', '-p', 'depth:=1000')) as started:
        wait_for_relay(started)
        for number in range(200):
            publisher.publish(Episode(episode=number))
        spin_until(lambda: len(messages) == 200, 'all messages')
        numbers = [each.episode for each in messages]
        assert sorted(numbers) == list(range(200)) != numbers
        counts = summary(started)
        assert counts['relayed'] == counts['heard'] == 200
        assert counts['delayed'] > 20 and counts['reordered'] > 20


@pytest.mark.long
def test_a_missing_publisher_is_warned_of_once_and_relayed_later(tmp_path, node, spin_until):
    with nodes(tmp_path, fault_injector=ONE) as started:
        waits = ('waits for a publisher on out/before '
                 '(a node started with -r out:=out/before)')
        wait_until(log_has(started['fault_injector'], waits), 'warning')
        publisher = node.create_publisher(Episode, 'out/before', LATCHED)
        publisher.publish(Episode(episode=3))
        messages = received(node, Episode, 'out', LATCHED)
        spin_until(lambda: messages, 'message')
        assert messages[0].episode == 3
        text = started['fault_injector'].log.read_text()
        assert text.count('waits for') == 1
        assert 'relays out (comply_msgs/msg/Episode)' in text


@pytest.mark.long
def test_a_second_type_on_a_topic_is_warned_of_once(tmp_path, node, make_node, spin_until):
    other = make_node('other')  # DDS rejects a second type in one context
    publisher = node.create_publisher(Episode, 'out/before', LATCHED)
    messages = received(node, Episode, 'out', LATCHED)
    with nodes(tmp_path, fault_injector=('-p', 'topics:=[out, never]')) as started:
        wait_for_relay(started)
        other.create_publisher(Action, 'out/before', LATCHED)
        process = started['fault_injector']
        sentence = ('out/before must have messages of one type, got comply_msgs/msg/Action and '
                    'comply_msgs/msg/Episode; the type that came first is relayed')
        wait_until(log_has(process, sentence), 'warning')
        wait_until(log_has(process, 'waits for a publisher on never/before'), 'later warning')
        publisher.publish(Episode(episode=3))
        spin_until(lambda: messages, 'message of the first type')
        assert process.log.read_text().count('of one type') == 1


@pytest.mark.parametrize('kinds, rule', [
    ({'comply_msgs/msg/Episode', 'comply_msgs/msg/Action'},
     'of one type, got comply_msgs/msg/Action and comply_msgs/msg/Episode'),
    ({'no_such_msgs/msg/Word'}, 'of a package that is installed, got no_such_msgs/msg/Word'),
    ({'comply_msgs/msg/Word'}, 'of a package that is installed, got comply_msgs/msg/Word')])
def test_types_that_cannot_be_relayed_are_named(kinds, rule):
    with pytest.raises(TopicError, match=f'^out/before must have messages {rule}$'):
        message_type('out/before', kinds)


@pytest.mark.parametrize('argument, message', [
    ('drop:=1.5', 'drop must lie in [0, 1], got 1.5'),
    ('drop:=.nan', 'drop must lie in [0, 1], got nan'),
    ('longest_delay:=.nan', 'longest_delay must lie in [0, 60], got nan'),
    ('reorder:=yes', 'reorder must be a double such as 1.0, got True'),
    ('seed:=-1', 'seed must lie in [0, 9007199254740992], got -1'),
    ('depth:=0', 'depth must lie in [1, 100000], got 0'),
    ('topics:=out', "topics must be a list of strings such as [state, action], got 'out'"),
    ('topics:=[]', 'topics must be a list of strings such as [state, action], got []'),
    ("topics:=['']", "topics: topic name must not be empty string, got ''"),
    ('topics:=[out, out]', "topics must name each topic once, got 'out' and 'out'"),
    ('topics:=[out, /out]', "topics must name each topic once, got 'out' and '/out'"),
])
@pytest.mark.long
def test_a_wrong_parameter_is_one_line_and_exit_code_2(argument, message):
    done = run('fault_injector', '--ros-args', '-p', argument)
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr == f'fault_injector: parameter {message}\n'


def test_a_remapping_that_would_make_a_circle_is_rejected():
    done = run('fault_injector', '--ros-args', '-p', 'topics:=[out]', '-r', 'out/before:=out')
    assert (done.returncode, done.stderr) == (2, (
        'fault_injector: parameter topics: out and out/before must be two topics, got /out '
        'for both\n'))
