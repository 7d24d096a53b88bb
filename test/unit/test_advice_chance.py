# SPDX-License-Identifier: Apache-2.0
"""Probability that advice is as good as any other action, by examples worked by hand."""

import math

import pytest
from tiny_worlds import Bench, room, see

from comply_ros.learner.advice_chance import advice_chance, chance_as_good, most_returns
from comply_ros.learner.learner_state import CHANGE, TERMINAL
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP


def mentored(agreed, **settings):
    """Return a bench where 10 was earned, p is 0.5, and a share of ten pieces of advice good."""
    bench = Bench(room(), learns_model=True, trust='track_record', slip_prior=1.0, **settings)
    bench.state.pooled[...] = [1.0, 3.0, 10.0, 10.0, 0.0]
    bench.state.advice_agreed[0], bench.state.advice_seen[0] = 10.0 * agreed, 10.0
    return bench


def compared(agreed, left=1.0, right=2.0, samples=1, **settings):
    """Return a bench in which LEFT and RIGHT were tried, and have these values in state 4."""
    bench = mentored(agreed, **settings)
    see(bench, LEFT, (samples, TERMINAL, left))
    see(bench, RIGHT, (samples, TERMINAL, right))
    bench.state.q[4] = [left, right, 0.0, 0.0]
    return bench


def chance(as_run, bench, advice):
    """Return the probability that advice in state 4 is as good as any other action."""
    return as_run(advice_chance)(4, 0, advice, bench.kernel_config, bench.state)


def test_the_best_action_is_as_good_as_any_other(as_run):
    bench = compared(0.6)
    assert chance(as_run, bench, RIGHT) == 1.0
    bench.state.q[4, LEFT] = 1.9995  # 0.002 of 10, times the credit of 0.04
    assert chance(as_run, bench, LEFT) == 1.0


@pytest.mark.parametrize('samples, own_variance', [
    (1, 1.44), (2, 2 * 0.48 / 3), (5, 2 * 0.16 / 6), (9, 2 * 0.16 / 10)])
def test_a_value_may_be_the_lower_one_by_chance(as_run, samples, own_variance):
    # All samples of an action are alike. Typical is 1.44 / (1 + w + w): 0.12 * 10 is supposed
    # once, w is 0, 1, 4 and 4. An action has two samples of it, beside its own ones.
    bench = compared(0.9, 1.8, 2.0, samples)
    error = math.sqrt(2 * own_variance / (samples + 1.0))
    p = as_run(chance_as_good)(4, LEFT, RIGHT, bench.kernel_config, bench.state)
    assert p == pytest.approx(1 / (1 + math.exp(1.7 * 0.2 / error)))


def test_values_that_vary_leave_more_to_chance(as_run):
    bench = compared(0.9, 1.8, 2.0, advice_slack=0.0)
    see(bench, RIGHT, (1, TERMINAL, 2.0), (1, 3, 4.0))  # three samples: 2, 2 and 4
    bench.state.q[4, RIGHT] = 3.0
    bench.state.sample_squares[4, RIGHT] = 8.0 / 3.0
    # Typical is (0 + 2 (8 / 3) / 2) / (1 + 2) = 8 / 9. LEFT, with one sample, has that variance;
    # RIGHT with three (8 / 3 + 2 (8 / 9)) / 4 = 10 / 9. The prior counts as one sample.
    error = math.sqrt(8 / 9 / 2 + 10 / 9 / 4)
    p = as_run(chance_as_good)(4, LEFT, RIGHT, bench.kernel_config, bench.state)
    assert p == pytest.approx(1 / (1 + math.exp(1.7 * 1.2 / error)))


def test_many_samples_of_one_action_do_not_say_how_much_another_one_varies(as_run):
    bench = compared(0.9, 1.8, 2.0, advice_slack=0.0)
    bench.state.visits[4, [LEFT, RIGHT]] = 4.0, 1001.0
    bench.state.sample_squares[4, LEFT] = 6.0
    # Typical is (2 (6 / 2) + 4 x 0) / (1 + 2 + 4) = 6 / 7, and LEFT has (6 + 2 (6 / 7)) / 4.
    error = math.sqrt((6 + 12 / 7) / 4 / 4 + 12 / 7 / 1001 / 1001)
    p = as_run(chance_as_good)(4, LEFT, RIGHT, bench.kernel_config, bench.state)
    assert p == pytest.approx(1 / (1 + math.exp(1.7 * 0.2 / error)))


@pytest.mark.parametrize('hits, change', [(1.0, 0.6), (3.0, 0.0)])  # p is 0.5; or nothing slips
def test_a_value_that_still_changes_is_not_known_better_than_that(as_run, hits, change):
    bench = compared(0.9, 1.8, 2.0, 2)
    bench.state.pooled[0] = hits
    bench.state.sample_squares[4, [LEFT, RIGHT]] = 1.0
    before = as_run(chance_as_good)(4, LEFT, RIGHT, bench.kernel_config, bench.state)
    bench.state.value_changes[4, CHANGE] = 2.0
    after = as_run(chance_as_good)(4, LEFT, RIGHT, bench.kernel_config, bench.state)
    odds = [math.log(1 / p - 1) / 1.7 / 0.2 for p in (before, after)]  # 1 / error
    assert odds[1] ** -2 == pytest.approx(odds[0] ** -2 + change ** 2)


def test_the_record_of_the_mentor_speaks_for_advice_that_looks_worse(as_run):
    # e = sqrt(2 * 1.44 / 2) = 1.2, so P = 1 / (1 + exp(1.7 / 1.2)) = 0.195.
    p = 1 / (1 + math.exp(1.7 / 1.2))
    for rho in (0.9, 0.85):
        likely = p * rho / (p * rho + (1 - p) * (1 - rho))
        assert likely > 0.5
        assert chance(as_run, compared(rho), LEFT) == pytest.approx(likely)
    assert chance(as_run, compared(0.8), LEFT) == 0.0  # 0.195 / 0.805 * 0.8 / 0.2 is below 1


def test_a_mentor_that_was_never_wrong_counts_as_right_in_995_of_1000(as_run):
    p = 1 / (1 + math.exp(1.7 / 1.2))
    assert chance(as_run, compared(1.0), LEFT) == pytest.approx(
        p * 0.995 / (p * 0.995 + (1 - p) * 0.005))


def test_where_nothing_slips_a_worse_value_is_no_chance(as_run):
    bench = compared(1.0)
    bench.state.pooled[:2] = 3.0
    assert chance(as_run, bench, LEFT) == 0.0
    assert chance(as_run, bench, RIGHT) == 1.0


@pytest.mark.parametrize('agreed, held', [(0.95, True), (0.85, False)])
def test_what_was_never_tried_speaks_against_the_advice_of_a_doubtful_mentor_only(
        as_run, agreed, held):
    bench = compared(agreed, 2.0, 1.0)  # the credit is 0.81, and 0.49
    bench.state.q[4, UP] = 3.0  # never tried
    assert (chance(as_run, bench, LEFT) == 1.0) is held


def test_advice_that_was_never_tried_holds_only_where_it_is_the_best(as_run):
    bench = compared(1.0)
    bench.state.q[4, UP] = 1.5
    assert chance(as_run, bench, UP) == 0.0
    bench.state.q[4, UP] = 2.5
    assert chance(as_run, bench, UP) == 1.0


def test_in_a_loop_only_the_best_of_actions_that_were_all_tried_holds(as_run):
    bench = compared(1.0)
    bench.state.visits[4] = 4.0
    bench.state.traces[4, 0] = 17.0  # 4 + 24 * 0.5 is not enough
    assert [chance(as_run, bench, a) for a in range(4)] == [0.0, 1.0, 0.0, 0.0]
    bench.state.visits[4, DOWN] = 1.0
    assert chance(as_run, bench, RIGHT) == 0.0


def test_slips_lead_back_too(as_run):
    bench = mentored(1.0)
    assert as_run(most_returns)(bench.state.pooled) == 16.0
    bench.state.pooled[:2] = 94.0, 99.0  # p is 0.95
    assert as_run(most_returns)(bench.state.pooled) == pytest.approx(5.2)


def test_a_choice_leaves_no_trace_in_the_state(as_run):
    bench = compared(0.9)
    before = [array.copy() for array in bench.state]
    assert 0.5 < chance(as_run, bench, LEFT) < 1.0
    assert all((array == each).all() for array, each in zip(bench.state, before))
