# SPDX-License-Identifier: Apache-2.0
"""The iterations of a learner that reports none, worked by hand."""

from math import isnan

from comply_ros.protocol.iteration_counter import IterationCounter
from comply_ros.protocol.messages import Episode


def episode(number, total_reward, steps=4):
    """Return the report of an episode in run 7."""
    return Episode(7, number, steps, total_reward, True, False)


def test_two_episodes_of_returns_1_and_4_are_an_iteration_of_2_and_a_half():
    counter = IterationCounter(iterations=2, episodes=2)
    assert counter.add(episode(1, 1.0)) is None
    progress = counter.add(episode(2, 4.0, steps=6))
    assert progress[:6] == (7, 1, 2, 2, 10, 2.5) and isnan(progress.confidence)
    assert not progress.finished
    counter.add(episode(3, 0.0))
    assert counter.add(episode(4, 1.0)).finished


def test_an_episode_that_comes_twice_or_too_early_is_not_counted():
    counter = IterationCounter(iterations=9, episodes=1)
    assert counter.add(episode(2, 1.0)) is None and counter.missing_before(episode(2, 1.0)) == 1
    assert counter.add(episode(1, 1.0)).iteration == 1
    assert counter.add(episode(1, 1.0)) is None
    assert [counter.missing_before(episode(k, 1.0)) for k in (1, 2, 1002)] == [0, 0, 1000]


def test_what_comes_after_the_last_iteration_is_not_counted():
    counter = IterationCounter(iterations=1, episodes=1)
    assert counter.add(episode(1, 1.0)).finished
    assert counter.add(episode(2, 1.0)) is None
