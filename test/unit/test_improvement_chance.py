# SPDX-License-Identifier: Apache-2.0
"""Chances that an action is better than it looks, by examples worked by hand."""

import math

import pytest
from tiny_worlds import Bench, model_bench, room, see

from comply_ros.learner.improvement_chance import update_potential
from comply_ros.learner.learner_state import (
    HITS,
    IN_USE,
    SAMPLES,
    TERMINAL,
    TRIALS,
    USUAL_VALUE,
    VALUE_SUM,
)
from comply_ros.learner.outcome_model import back_up
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP


def two_means(size, **settings):
    """Return a bench in which RIGHT was worth 6, 6, 4 and 4, and UP 4 and 4; nothing slips."""
    bench = Bench(room(), learns_model=True, **settings)
    bench.state.pooled[[HITS, TRIALS]] = 3.0
    bench.state.prior_sizes[IN_USE] = size
    bench.state.workspace[RIGHT, [SAMPLES, VALUE_SUM, USUAL_VALUE]] = 4, 20, 6
    bench.state.workspace[UP, [SAMPLES, VALUE_SUM, USUAL_VALUE]] = 2, 8, 4
    bench.state.visits[4, [RIGHT, UP]] = 5.0, 3.0
    bench.state.sample_squares[4, RIGHT] = 4.0
    bench.state.q[4, [RIGHT, UP]] = 5.0, 4.0
    return bench


def doubted(as_run, bench, margin=0.003):
    """Return the chance to try each action of state 4, where RIGHT is the best one."""
    as_run(update_potential)(
        4, RIGHT, margin, 6.0, TERMINAL, bench.kernel_config, bench.state)
    return bench.state.potential[4].tolist()


@pytest.mark.parametrize('size, weight', [(1, 0.5), (2, 0.5), (8, 0.125), (32, 0.03125)])
def test_a_mean_of_few_samples_may_be_too_low(as_run, size, weight):
    # The squares of the deviations are 4 x 1, of 6 samples and 2 means: the variance is 1.
    error = math.sqrt(1 / (2 + size) + 1 / (4 + size))
    chance = weight / (1 + math.exp(1.7 * 1 / error))
    assert doubted(as_run, two_means(size)) == pytest.approx([0.0, 0.0, 0.0, chance])


def test_the_weight_of_that_chance_is_a_setting(as_run):
    half, whole = (doubted(as_run, two_means(2, doubt_weight=weight))[UP] for weight in (0.5, 1.0))
    assert whole == pytest.approx(2 * half)
    assert doubted(as_run, two_means(2, doubt_weight=0.0)) == [0.0] * 4


def test_an_action_that_is_worse_by_far_is_not_in_doubt(as_run):
    bench = two_means(2)
    bench.state.q[4, UP] = -1.0  # 6 / 0.645 is more than 8 errors
    assert doubted(as_run, bench) == [0.0] * 4


@pytest.mark.parametrize('rounded', [0.0, 1e-13])
def test_where_all_samples_are_alike_no_mean_is_in_doubt(as_run, rounded):
    bench = two_means(2)
    bench.state.sample_squares[4, RIGHT] = rounded  # 5, 5, 5 and 5
    assert doubted(as_run, bench) == [0.0] * 4


def test_a_difference_that_is_too_small_for_its_error_divides_nothing_by_0(as_run):
    bench = two_means(32)
    bench.state.sample_squares[4, RIGHT] = 1e-322  # a share of it is 0 in a computer
    bench.state.q[4, UP] = 5.0
    assert doubted(as_run, bench, margin=0.0) == [0.0] * 4


def test_an_action_may_be_tried_again_that_may_lead_to_the_best_outcome(as_run):
    # The best outcome is state 5, where only slips led so far. Each of 3 other actions slips there
    # with probability 0.2 / 3, and would lead there with 0.8: the ratio is 1 / 12. UP had another
    # outcome twice, DOWN four times; LEFT slipped there once, and had its usual one twice.
    bench = model_bench(doubt_weight=0.0)
    bench.state.values[[1, 3, 5, 7]] = 0.0, 1.0, 9.0, 2.0
    see(bench, UP, (2, 7, -1.0))
    see(bench, DOWN, (4, 1, -1.0))
    see(bench, LEFT, (2, 3, -1.0), (1, 5, -1.0))
    see(bench, RIGHT, (9, 8, 4.0), (1, 5, -1.0))
    as_run(back_up)(4, bench.kernel_config, bench.state)
    assert bench.state.q[4].argmax() == RIGHT
    assert bench.state.potential[4].tolist() == pytest.approx([1 / 12, 0.0, 12 ** -4, 12 ** -2])


def test_nothing_is_in_doubt_where_nothing_slips(as_run):
    bench = model_bench(doubt_weight=0.0)
    bench.state.pooled[HITS] = 4.0
    bench.state.values[5] = 9.0
    for a, successor in ((UP, 7), (DOWN, 1), (LEFT, 3)):
        see(bench, a, (1, successor, -1.0))
    see(bench, RIGHT, (3, 8, 4.0), (1, 5, -1.0))
    as_run(back_up)(4, bench.kernel_config, bench.state)
    assert bench.state.potential[4].tolist() == [0.0] * 4
