# SPDX-License-Identifier: Apache-2.0
"""The number of actions as kernels know it, and operations on the values of one state."""

import numpy as np
import pytest
from tiny_worlds import Bench, corridor, FOUR, room

from comply_ros.numerics.action_values import (
    actions_for_kernels,
    count_actions,
    count_untried,
    greedy_or_untried_action,
    max_q_except,
    MOST_UNROLLED,
    NOTHING,
)
from comply_ros.world.grid import LEFT, RIGHT, UP


@pytest.mark.parametrize('number', [1, 2, 4, 6, MOST_UNROLLED, MOST_UNROLLED + 1, 300])
def test_kernels_know_any_number_of_actions(as_run, number):
    assert as_run(count_actions)(actions_for_kernels(number)) == number


def test_only_small_numbers_of_actions_have_code_of_their_own():
    lengths = [len(actions_for_kernels(number)) for number in (1, 2, 4, MOST_UNROLLED, 17, 300)]
    assert lengths == [1, 2, 4, MOST_UNROLLED, 1, 1]


def test_the_highest_other_value(as_run):
    bench = Bench(room())
    bench.state.q[4] = [1.0, 3.0, 2.0, -1.0]
    assert as_run(max_q_except)(4, RIGHT, bench.state.q, FOUR) == 2.0
    assert as_run(max_q_except)(4, -1, bench.state.q, FOUR) == 3.0
    assert as_run(max_q_except)(0, RIGHT, Bench(corridor()).state.q, FOUR) == NOTHING


@pytest.mark.parametrize('number', [1, 3, 5, 20])
def test_the_highest_other_value_of_any_number_of_actions(as_run, number):
    q, actions = np.arange(number, dtype=float)[None], actions_for_kernels(number)
    assert as_run(max_q_except)(0, -1, q, actions) == number - 1
    assert as_run(max_q_except)(0, 0, q, actions) == (number - 1 if number > 1 else NOTHING)
    assert as_run(max_q_except)(0, number - 1, q, actions) == (
        number - 2 if number > 1 else NOTHING)


def test_an_action_that_the_state_does_not_have_does_not_count_as_untried(as_run):
    bench = Bench(room())
    assert as_run(count_untried)(0, bench.state.q, bench.state.visits, FOUR) == 2
    bench.state.visits[0, RIGHT] = 2.0
    assert as_run(count_untried)(0, bench.state.q, bench.state.visits, FOUR) == 1


@pytest.mark.parametrize('number', [2, 6, 20])
def test_untried_actions_are_counted_of_any_number(as_run, number):
    q, visits = np.zeros((1, number)), np.ones((1, number))
    q[0, 0], visits[0, 1] = -np.inf, 2.0
    assert as_run(count_untried)(0, q, visits, actions_for_kernels(number)) == number - 2


# UP was tried, and the state does not have DOWN.
@pytest.mark.parametrize('u, action', [(0.0, LEFT), (0.49, LEFT), (0.5, RIGHT), (0.99, RIGHT)])
def test_untried_actions_are_equally_likely(as_run, u, action):
    q, visits = np.array([[1.0, 2.0, -np.inf, 3.0]]), np.array([[1.0, 1.0, 1.0, 2.0]])
    assert as_run(greedy_or_untried_action)(0, True, u, q, visits, FOUR) == action


def test_where_every_action_was_tried_the_best_one_is_chosen(as_run):
    q, visits = np.array([[1.0, 2.0, -np.inf, 3.0]]), np.array([[2.0, 2.0, 1.0, 2.0]])
    assert as_run(greedy_or_untried_action)(0, True, 0.0, q, visits, FOUR) == UP
