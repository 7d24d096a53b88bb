# SPDX-License-Identifier: Apache-2.0
"""The system clock is set back by an hour under running nodes: each goes on at its pace."""

from contextlib import ExitStack
import time

from node_processes import nodes
from pty_session import pty_session
import pytest
from ros_client import ros_client
from ros_domain import own_domain
from system_clock import needs_faketime, SystemClock

from comply_ros.nodes.topics import STATE
from comply_ros.nodes.viewer_messages import ROBOT

pytestmark = needs_faketime
HOUR = 3600.0
SMALL = ('-p', 'map:=bar_grid')
ENDLESS = ('-p', 'iterations:=0', '-p', 'remembers_advice:=false')
RELAYED = ('-r', 'recommendation:=recommendation/before')
DELAYED = ('-p', 'topics:=[recommendation]', '-p', 'delay:=1.0', '-p', 'longest_delay:=0.1')
# Nodes that go on by their own timers, by namespace. In `steered` a person is silent until the
# patience is over; in `unadvised` there is no mentor; in `alone` there is no learner.
LESSONS = {
    'paced': {'grid_world': (*SMALL, '-p', 'rate:=20.0'), 'mentor': RELAYED,
              'fault_injector': DELAYED, 'learner': ENDLESS, 'viewer': (), 'record': ()},
    'steered': {'grid_world': SMALL, 'learner': ENDLESS},
    'unadvised': {'grid_world': SMALL, 'learner': (*ENDLESS, '-p', 'advice_timeout:=0.1')},
    'alone': {'grid_world': SMALL}}
# What shows that a node goes on, as a count that grows with every second.
COUNTS = {
    'health of the world': lambda lessons: len(lessons.client.health['paced/grid_world']),
    'health of the mentor': lambda lessons: len(lessons.client.health['paced/mentor']),
    'health of the learner': lambda lessons: len(lessons.client.health['paced/learner']),
    'health of the human mentor': lambda lessons: len(lessons.client.health['steered/mentor']),
    'steps at a rate': lambda lessons: lessons.client.steps('paced/grid_world'),
    'steps with delayed advice': lambda lessons: lessons.client.steps('paced/learner'),
    'steps without the person': lambda lessons: lessons.client.steps('steered/learner'),
    'steps without a mentor': lambda lessons: lessons.client.steps('unadvised/learner'),
    'repeated observations': lambda lessons: len(lessons.client.received['alone/state']),
    'poses of the viewer': lambda lessons: len(lessons.poses),
    'kilobytes in the bag': lambda lessons: lessons.bag_size() // 1000}


class RunningLessons:
    """All the lessons, and what they have published and written so far."""

    def __init__(self, client, bag):
        self.client, self._bag, self.poses = client, bag, []
        client.subscribe(*(STATE._replace(name=f'{namespace}/{STATE.name}')
                           for namespace in LESSONS))
        client.create_subscription(
            ROBOT.message, f'paced/{ROBOT.name}', self.poses.append, ROBOT.qos)

    def bag_size(self):
        """Return the bytes of the bag that are in its file."""
        return sum(each.stat().st_size for each in self._bag.glob('*.mcap'))

    def wait_for_growth(self, what, before=0):
        """Wait until a count is larger than before, by what needs more than one call back."""
        self.client.until(lambda: COUNTS[what](self) >= before + 3, f'growth of {what}')


@pytest.fixture(scope='module')
def lessons(tmp_path_factory):
    """Return running lessons, and their counts when the clock had been set back by an hour."""
    folder = tmp_path_factory.mktemp('lessons')
    with pytest.MonkeyPatch.context() as monkeypatch, ExitStack() as stack:
        stack.enter_context(own_domain(monkeypatch))
        clock = SystemClock(monkeypatch, folder / 'clock')
        running = RunningLessons(stack.enter_context(ros_client()), folder / 'bag')
        for namespace, arguments in LESSONS.items():
            stack.enter_context(nodes(folder / namespace, **{
                name: ('-r', f'__ns:=/{namespace}', *given,
                       *(('-p', f'bag:={folder}/bag') if name == 'record' else ()))
                for name, given in arguments.items()}))
        session = stack.enter_context(pty_session(
            '--ros-args', '-r', '__ns:=/steered', '-p', 'patience:=0.05'))
        running.client.create_timer(0.05, session.read)  # a full terminal stops the program
        for what in COUNTS:
            running.wait_for_growth(what)
        clock.set_back(1)
        yield running, {what: count(running) for what, count in COUNTS.items()}


@pytest.mark.parametrize('what', COUNTS)
@pytest.mark.long
def test_it_goes_on_after_the_system_clock_was_set_back(lessons, what):
    running, before = lessons
    running.wait_for_growth(what, before[what])


@pytest.mark.long
def test_time_stamps_follow_the_system_clock(lessons):
    """They show that the clock of the nodes was set back."""
    running, _ = lessons

    def are_back():
        newest = running.poses[-1].header.stamp.sec
        return newest < time.time() - HOUR + 100.0
    running.client.until(are_back, 'pose an hour ago')
