# SPDX-License-Identifier: Apache-2.0
"""Real nodes in trouble: killed, twice there, unheard, misunderstood."""

from contextlib import ExitStack
import os
import random
import re
import signal
import subprocess
import sys

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lesson_summaries import assert_equal_but_for_time, lesson_summary, trained_summary
from node_processes import log_has, nodes
import pytest
from short_training import (
    digest_of,
    LEARNER,
    MENTOR,
    received,
    SMALL,
    spin_until,
    trained,
)
from std_msgs.msg import String
from waiting import wait_until

from comply_ros.nodes import topics
from comply_ros.nodes.diagnostics import TOPIC

pytestmark = pytest.mark.usefixtures('domain')
SLOW = (*SMALL, '-p', 'rate:=200.0')  # so that things happen in the middle of the learning,
LONG = (*LEARNER, '-p', 'iterations:=16')  # which takes more than ten seconds then
FAULTS = ('drop', 'delay', 'duplicate', 'reorder')
RELAYED = {'grid_world': 'state', 'mentor': 'recommendation', 'learner': 'action'}


def health_of(node):
    """Return a table that fills with the last `DiagnosticStatus` of each node, by name."""
    table = {}

    def take(message):
        table.update((status.name, status) for status in message.status)
    node.create_subscription(DiagnosticArray, TOPIC, take, 10)
    return table


def says(table, name, words):
    """Return a condition: the node says these words of itself."""
    return lambda: name in table and words in table[name].message


@pytest.mark.parametrize('victim', ['grid_world', 'mentor', 'learner'])
@pytest.mark.long
def test_a_node_that_is_killed_again_and_again_and_started_by_hand_loses_nothing(
        tmp_path, node, victim):
    msg, moment = received(node, topics.ACTION), random.Random(victim)
    keeps = ('-p', f'state_dir:={tmp_path}/state')
    arguments = {'grid_world': (*SLOW, *keeps), 'mentor': (*MENTOR, *keeps),
                 'learner': (*LONG, *keeps)}
    own = arguments.pop(victim)
    with nodes(tmp_path, **arguments) as others:
        for number in range(4):
            with nodes(tmp_path / str(number), **{victim: own}) as started:
                wanted = len(msg) + moment.randrange(5, 100)
                spin_until(node, lambda: len(msg) > wanted, 'learning')
                os.kill(started[victim].pid, signal.SIGKILL)
        with nodes(tmp_path / 'last', **{victim: own}) as last:
            learner = {**others, **last}['learner']
            assert digest_of(learner) == trained(iterations=16)


@pytest.mark.long
def test_a_fifth_of_all_messages_lost_late_doubled_or_shuffled_changes_no_bit(tmp_path, expected):
    remaps = {name: ('-r', f'{topic}:={topic}/before') for name, topic in RELAYED.items()}
    faults = [word for name in FAULTS for word in ('-p', f'{name}:=0.2')]
    with nodes(tmp_path, fault_injector=(*faults, '-p', 'seed:=5'),
               grid_world=(*SMALL, *remaps['grid_world']), mentor=(*MENTOR, *remaps['mentor']),
               learner=(*LEARNER, *remaps['learner'])) as started:
        wait_until(log_has(started['learner'], 'finished'), 'end of the learning')
        assert digest_of(started['learner']) == expected
        started['fault_injector'].interrupt()
        assert started['fault_injector'].wait() == 0
        counts = re.findall(r'(\d+) (dropped|delayed|duplicated|reordered)',
                            started['fault_injector'].log.read_text())
        assert len(counts) == len(RELAYED) * len(FAULTS)
        assert all(int(count) > 10 for count, _ in counts)


@pytest.mark.long
def test_a_second_learner_stands_aside_and_the_first_one_keeps_the_run(tmp_path, node):
    msg = received(node, topics.ACTION)
    with nodes(tmp_path, grid_world=SLOW, mentor=MENTOR, learner=LONG) as started:
        spin_until(node, lambda: len(msg) > 20, 'learning')
        with nodes(tmp_path / 'second', learner=LEARNER) as second:
            wait_until(log_has(second['learner'], 'inactive: learner '), 'second learner')
            assert digest_of(started['learner']) == trained(iterations=16)
            assert 'finished' not in second['learner'].log.read_text()
        assert 'rejected' not in started['learner'].log.read_text()


def test_a_second_world_stands_aside_and_the_first_one_goes_on(tmp_path, node):
    msg, health = received(node, topics.ACTION), health_of(node)
    with nodes(tmp_path, grid_world=SLOW, mentor=MENTOR, learner=LONG) as started:
        spin_until(node, lambda: len(msg) > 20, 'learning')
        with nodes(tmp_path / 'second', grid_world=('-p', 'map:=free_grid')) as two:
            words = "another world, 'bar_grid', came first and owns these topics"
            wait_until(log_has(two['grid_world'], words), words)
            spin_until(node, lambda: any(status.level == DiagnosticStatus.ERROR and
                                         'inactive: another world' in status.message
                                         for status in health.values()), 'diagnostics')
            assert digest_of(started['learner']) == trained(iterations=16)
        assert 'free_grid' not in started['learner'].log.read_text()


@pytest.mark.long
def test_a_lesson_goes_on_while_somebody_starts_the_nodes_twice(tmp_path):
    argv = ('--map', 'bar_grid', '--mentor', 'noisy:0.3', '--iterations', '400',
            '--episodes', '1')
    with ExitStack() as stack:
        waiting = subprocess.Popen([sys.executable, '-c', STARTS_TWICE])
        stack.callback(waiting.wait)
        stack.callback(waiting.terminate)
        result = lesson_summary(tmp_path / 'lesson', *argv)
    assert_equal_but_for_time(trained_summary(tmp_path / 'train', *argv), result)


STARTS_TWICE = """
import signal, sys, tempfile
import rclpy
from comply_ros.nodes.node_processes import NodeProcess
from comply_ros.nodes.topics import PROGRESS
signal.signal(signal.SIGTERM, lambda *_: sys.exit())
rclpy.init(signal_handler_options=rclpy.SignalHandlerOptions.NO)
node, found = rclpy.create_node('observer'), []
node.create_subscription(PROGRESS.message, PROGRESS.name, found.append, PROGRESS.qos)
while not found:
    rclpy.spin_once(node, timeout_sec=0.1)
with tempfile.TemporaryDirectory() as folder:
    started = [NodeProcess(name, [], folder) for name in ('grid_world', 'learner')]
    try:
        signal.pause()
    finally:
        for each in started:
            each.interrupt()
        for each in started:
            each.wait()
"""


@pytest.mark.long
def test_a_topic_of_another_type_is_warned_of_once(tmp_path, node):
    with nodes(tmp_path, learner=()) as started:
        speaker = node.create_publisher(String, 'state', 1)
        node.create_subscription(String, 'action', print, 1)
        warnings = ('topic /state must have the type comply_msgs/msg/StateReward, but the '
                    'publisher of /test has std_msgs/msg/String: no messages are exchanged '
                    'with it',
                    'topic /action must have the type comply_msgs/msg/Action, but the '
                    'subscription of /test has std_msgs/msg/String: no messages are exchanged '
                    'with it')
        for warning in warnings:
            wait_until(log_has(started['learner'], warning), warning)
        speaker.publish(String(data='over here'))
        wait_until(log_has(started['learner'], 'waits for a world'), 'a second look')
        assert [started['learner'].log.read_text().count(each) for each in warnings] == [1, 1]


def test_a_silent_mentor_counts_as_no_advice_where_a_time_is_set(tmp_path, node):
    health = health_of(node)
    with nodes(tmp_path, grid_world=SMALL, learner=(
            '-p', 'iterations:=1', '-p', 'episodes:=1', '-p', 'advice_timeout:=0.01')) as started:
        words = 'no recommendation came within 0.01 s: continues as without advice (harmless; '
        wait_until(log_has(started['learner'], 'finished 1 iterations'), 'learning alone')
        assert started['learner'].log.read_text().count(words) == 1
        spin_until(node, says(health, 'learner', 'has finished'), 'health')
        values = {each.key: each.value for each in health['learner'].values}
        assert int(values['ignored: no advice in time']) > 5


@pytest.mark.long
def test_a_silent_mentor_is_waited_for_with_one_warning_where_no_time_is_set(tmp_path, node):
    health = health_of(node)
    with nodes(tmp_path, grid_world=SMALL, learner=LEARNER) as started:
        words = 'waits for a recommendation in state '
        spin_until(node, says(health, 'learner', words), 'health')
        assert health['learner'].level == DiagnosticStatus.WARN
        with nodes(tmp_path / 'late', mentor=MENTOR):
            assert digest_of(started['learner'])
        assert started['learner'].log.read_text().count(words) == 1
        spin_until(node, says(health, 'learner', 'has finished'), 'health')


def test_every_node_tells_how_it_is(tmp_path, node, expected):
    health = health_of(node)
    keeps = ('-p', f'state_dir:={tmp_path}/state')
    with nodes(tmp_path, grid_world=(*SMALL, *keeps), mentor=MENTOR,
               learner=(*LEARNER, *keeps)) as started:
        assert digest_of(started['learner']) == expected

        def values_of(name):
            return {each.key: each.value for each in health[name].values}
        spin_until(node, lambda: len(health) == 3 and says(health, 'learner', 'has finished')()
                   and all(int(values_of(name)['steps']) > 10 for name in started),
                   'health of all, after the learning')
        for name, process in started.items():
            values = values_of(name)
            assert str(process.pid) in health[name].hardware_id
            assert float(values['steps per second']) >= 0.0
            if name == 'mentor':
                assert values['state_dir'] == 'nothing is stored'
            else:
                assert int(values['journal bytes']) > 100
                assert re.match(r'\d{4}-\d\d-\d\d \d\d:\d\d:\d\d', values['last checkpoint'])
