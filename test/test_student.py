# SPDX-License-Identifier: Apache-2.0
"""A learner in one world, step by step."""

from math import isnan

import pytest
from tiny_worlds import Bench, corridor

from comply_ros.learner.student import Student
from comply_ros.world.grid import LEFT, RIGHT


def student(**settings):
    """Return a student in the corridor, with one episode an iteration."""
    return Student(corridor(), Bench(corridor(), episodes=1, iterations=2, **settings).method)


def walk(learner, *rewards):
    """Let it walk to the right over an episode that it sees whole; return the progress."""
    learner.begin_episode()
    for s, r in enumerate(rewards):
        learner.learn(s, RIGHT, r, s + 1, RIGHT, s == 1, -1)
    return learner.end_episode()


def test_an_iteration_ends_with_its_progress():
    progress = walk(student(temperature=2.0), -1.0, 10.0)
    assert (progress.iteration, progress.iterations, progress.episodes) == (1, 2, 1)
    assert (progress.steps, progress.mean_return, progress.temperature) == (2, 9.0, 2.0)
    assert isnan(progress.confidence) and not progress.finished


def test_it_has_finished_after_the_last_iteration():
    learner = student()
    assert [walk(learner, -1.0, 10.0).finished for _ in range(2)] == [False, True]
    assert learner.finished


def test_an_episode_that_was_not_seen_whole_does_not_count():
    learner = student()
    learner.begin_episode()
    learner.lose_track()
    learner.learn(1, RIGHT, 10.0, 2, LEFT, True, -1)
    assert learner.end_episode() is None
    assert learner.memory.q[1, RIGHT] > 0.0  # but it is learned from


def test_measuring_changes_nothing_but_the_counters():
    learner = student(measuring_iterations=1, trust='head_start', replays=True)
    learner.begin_episode()
    before = learner.memory.q.copy()
    learner.choose(0, RIGHT, 0, (0.5, 0.5))
    learner.learn(0, RIGHT, -1.0, 1, RIGHT, False, RIGHT)
    assert (learner.memory.q == before).all() and learner.steps == 1


def test_confidences_are_weighed_over_the_decisions_that_had_advice():
    learner = student()
    learner.begin_episode()
    for advice, p in ((RIGHT, 0.5), (RIGHT, 1.0), (-1, 0.0)):
        learner.record_confidence(advice, p)
    assert learner.end_episode().confidence == pytest.approx(0.75)


def test_traces_end_with_the_episode():
    learner = student(trace_decay=0.9)
    learner.begin_episode()
    learner.learn(0, RIGHT, -1.0, 1, RIGHT, False, -1)
    assert learner.memory.traces.any()
    learner.end_episode()
    assert not learner.memory.traces.any()
