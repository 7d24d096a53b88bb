# SPDX-License-Identifier: Apache-2.0
"""Which run the monitor of a lesson follows, and what it ignores, by messages over topics."""

from contextlib import nullcontext
from dataclasses import replace
from math import nan
import time
from types import SimpleNamespace

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from tiny_worlds import grid
from waiting import DEADLINE

from comply_ros.nodes.diagnostics import OK, process_name, RUN, TOPIC
from comply_ros.nodes.run_monitor import LessonFailed, RunMonitor
from comply_ros.nodes.topics import (
    encoder,
    EPISODE,
    MENTOR_POLICY,
    PROGRESS,
    RECOMMENDATION,
    topic_of_mentor,
    WORLD,
)
from comply_ros.protocol.iteration_counter import IterationCounter
from comply_ros.protocol.messages import Episode, Policy, Progress, Recommendation, REPORTS
from comply_ros.protocol.world_description import describe_world

GRID = grid('..G')
ADVICE = (1, 1, -1)


class Bench:
    """A monitor, and publishers of all that it follows, in one process."""

    def __init__(self, *arguments, **more):
        self.monitor = RunMonitor('', GRID, *arguments, **more)
        self._node = rclpy.create_node('publishers')
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.monitor)
        self._publishers = {}

    def publish(self, topic, msg):
        """Publish a tuple, as a node of its own, so that none takes the place of another."""
        publisher = self._node.create_publisher(topic.message, topic.name, topic.qos)
        publisher.publish(encoder(topic)(msg))
        end = time.monotonic() + 0.2
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.02)

    def publish_diagnostics(self, status):
        """Publish the status of a node."""
        publisher = self._node.create_publisher(DiagnosticArray, TOPIC, 10)
        end = time.monotonic() + DEADLINE
        while not self.monitor.own_run_known and time.monotonic() < end:
            publisher.publish(DiagnosticArray(status=[status]))
            self._executor.spin_once(timeout_sec=0.05)

    def spin_once(self):
        """Receive what has come."""
        self._executor.spin_once(timeout_sec=0.05)

    def world(self, run, began=0, grid=GRID):
        """Publish a world."""
        self.publish(WORLD, describe_world(grid, 'small', run, began))

    def advice(self, run, action=ADVICE, name=''):
        """Publish advice of a mentor for all states."""
        self.publish(topic_of_mentor(MENTOR_POLICY, name), Policy(run, action))

    def progress(self, run, iteration, **changes):
        """Publish an iteration of three."""
        msg = Progress(run, iteration, 3, 15, 10 * iteration, 2.0, 0.5, 1.0, iteration == 3)
        self.publish(PROGRESS, msg._replace(**changes))


@pytest.fixture
def bench(domain):
    """Return a `Bench`."""
    rclpy.init()
    try:
        yield Bench()
    finally:
        rclpy.try_shutdown()


@pytest.mark.parametrize('lost, outcome', [
    (REPORTS - 1, nullcontext()),  # the world still has them
    (REPORTS, pytest.raises(LessonFailed, match='1000 episodes before episode 1001 that did'))])
def test_episodes_that_are_lost_for_ever_end_a_lesson_with_an_external_learner(
        domain, lost, outcome):
    rclpy.init()
    try:
        bench = Bench('learner', IterationCounter(3, 2))
        bench.world(7)
        bench.monitor.own_run = 7
        with outcome:
            bench.publish(EPISODE, Episode(7, lost + 1, 4, 1.0, True, False))
    finally:
        rclpy.try_shutdown()


@pytest.mark.parametrize('began', [5, 20])
def test_the_run_is_the_one_with_progress_whatever_the_clocks_say(bench, began):
    bench.world(7, began=10)
    bench.advice(7)
    bench.world(8, began=began)  # another machine, whose clock may be wrong
    bench.advice(8, (1, 0, -1))
    bench.progress(7, 1)
    bench.progress(8, 1)
    assert [msg.run for msg in bench.monitor.progress] == [7]
    assert bench.monitor.advice.tolist() == list(ADVICE)


@pytest.mark.parametrize('own_run', [7, 8])
def test_a_run_of_the_same_map_that_is_not_of_the_world_of_the_lesson_is_told(bench, own_run):
    bench.monitor.processes = [SimpleNamespace(pid=4242, pids=[4242], name='grid_world')]
    bench.world(7)  # of others, perhaps: with another seed, say
    bench.advice(7)
    bench.progress(7, 1)
    assert not bench.monitor.own_run_known and not bench.monitor.follows_another_world
    status = DiagnosticStatus(name='grid_world', level=OK, hardware_id=process_name(4242),
                              values=[KeyValue(key=RUN, value=str(own_run))])
    bench.publish_diagnostics(status)
    assert bench.monitor.own_run_known
    assert bench.monitor.follows_another_world == (own_run == 8)


def test_a_world_with_another_map_is_ignored(bench):
    bench.world(8, grid=replace(GRID, step_limit=GRID.step_limit + 1))
    bench.progress(8, 1)
    bench.world(7)
    bench.progress(7, 1)
    assert [msg.run for msg in bench.monitor.progress] == [7]


def test_progress_that_comes_before_its_world_counts(bench):
    for iteration in (1, 2, 3):
        bench.progress(7, iteration)
    bench.advice(7)
    assert bench.monitor.progress == []
    bench.world(7)
    assert [msg.iteration for msg in bench.monitor.progress] == [1, 2, 3]
    assert bench.monitor.finished and bench.monitor.seconds() < 60.0


def test_a_lesson_is_not_finished_before_the_advice_is_known(bench):
    bench.world(7)
    for iteration in (1, 2, 3):
        bench.progress(7, iteration)
    assert not bench.monitor.finished
    bench.advice(7, (2, 2, -1))  # no action of these cells
    assert not bench.monitor.finished
    bench.advice(7)
    assert bench.monitor.finished


def test_the_confidence_in_each_mentor_is_no_iteration(bench):
    bench.world(7)
    for iteration in (1, 2):
        for name in ('', 'anna', 'bob'):
            bench.progress(7, iteration, mentor=name, confidence=0.25)
    assert [(msg.iteration, msg.mentor) for msg in bench.monitor.progress] == [(1, ''), (2, '')]


def test_a_lesson_with_several_mentors_waits_for_the_advice_of_each_in_their_order(domain):
    rclpy.init()
    try:
        bench = Bench(mentors=('bob', 'anna'))
        bench.world(7)
        for iteration in (1, 2, 3):
            bench.progress(7, iteration)
        for name in ('bob', 'anna'):
            bench.progress(7, 3, mentor=name)
        bench.advice(7, (1, 0, -1), 'anna')
        assert not bench.monitor.finished
        bench.advice(7, ADVICE, 'bob')
        assert bench.monitor.finished
        assert bench.monitor.advice.tolist() == [*ADVICE, 1, 0, -1]
        assert bench.monitor.other_mentors(False) == 0
        bench.publish(topic_of_mentor(RECOMMENDATION, 'carl'), Recommendation(7, 1, 0, 0, 1))
        end = time.monotonic() + DEADLINE
        while not bench.monitor.other_mentors(True) and time.monotonic() < end:
            bench.spin_once()
        assert bench.monitor.other_mentors(True) == 1
    finally:
        rclpy.try_shutdown()


def test_repeated_skipped_and_invalid_iterations_are_ignored(bench):
    bench.world(7)
    bench.progress(7, 1)
    bench.progress(7, 1)
    bench.progress(7, 3)
    bench.progress(7, 2, mean_return=float('nan'))
    bench.progress(7, 2, steps=10)
    bench.progress(7, 2)
    assert [(msg.iteration, msg.steps) for msg in bench.monitor.progress] == [(1, 10), (2, 20)]


def test_a_lesson_with_several_mentors_has_not_finished_before_the_confidence_in_each_is_known(
        domain):
    rclpy.init()
    try:
        bench = Bench(mentors=('anna', 'bob'))
        bench.world(7)
        for name in ('anna', 'bob'):
            bench.advice(7, name=name)
        for iteration in (1, 2, 3):
            bench.progress(7, iteration)
            bench.progress(7, iteration, mentor='anna', confidence=0.25 * iteration)
            if iteration != 2:
                assert not bench.monitor.finished
                bench.progress(7, iteration, mentor='bob', confidence=0.5)
        assert bench.monitor.finished
        confidences = bench.monitor.confidences()
        assert confidences['anna'] == [0.25, 0.5, 0.75]
        assert confidences['bob'] == pytest.approx([0.5, nan, 0.5], nan_ok=True)
    finally:
        rclpy.try_shutdown()


def test_the_confidence_in_the_only_mentor_is_that_of_the_iteration(bench):
    bench.world(7)
    bench.advice(7)
    for iteration in (1, 2, 3):
        bench.progress(7, iteration, confidence=0.25 * iteration)
    assert bench.monitor.finished
    assert bench.monitor.confidences() == {'': [0.25, 0.5, 0.75]}
