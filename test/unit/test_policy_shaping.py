# SPDX-License-Identifier: Apache-2.0
"""Policy shaping, and the estimated consistency of mentors, by examples worked by hand."""

import math

import numpy as np
import pytest
from tiny_worlds import advised, Bench, corridor, room

from comply_ros.learner.confidence import most_trusted_mentor
from comply_ros.learner.policy_shaping import estimated_consistency, record_consistency
from comply_ros.learner.update_rules import learn
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP


def test_policy_shaping_multiplies_the_softmax_by_the_odds_of_right_advice(as_run):
    # q (1, 2, -inf, 0), temperature 0.5: weights e^-2, 1, 0, e^-4 = 0.1353353, 1, 0, 0.0183156.
    # RIGHT: 0.9 * 1 / (0.9 * 1 + 0.1 * 0.1536509);
    # UP: 0.9 * 0.0183156 / (0.9 * 0.0183156 + 0.1 * 1.1353353)
    bench = Bench(room(), trust='shaping', confidence=0.9, temperature=0.5)
    bench.state.q[4] = [1.0, 2.0, -np.inf, 0.0]
    assert bench.confidence(as_run, advice=RIGHT) == pytest.approx(0.9832143, abs=1e-6)
    assert bench.confidence(as_run, advice=UP) == pytest.approx(0.1267834, abs=1e-7)


def test_policy_shaping_never_divides_0_by_0(as_run):
    bench = Bench(room(), trust='shaping', confidence=1.0, temperature=1e-9)
    bench.state.q[4] = [1.0, 2.0, -np.inf, 0.0]
    assert bench.confidence(as_run, advice=UP) == 0.0


def test_advice_that_is_right_half_of_the_time_leaves_the_softmax_as_it_is(as_run):
    """With consistency 1/2, following or not is the same draw as the softmax's own."""
    bench = Bench(room(), trust='shaping', confidence=0.5, temperature=0.5, excludes_refused=True)
    bench.state.q[4] = [1.0, 2.0, 1.5, 0.0]
    weights = np.exp(bench.state.q[4] / 0.5)
    assert bench.confidence(as_run, advice=UP) == pytest.approx(weights[UP] / weights.sum())


def estimating(n_mentors=2):
    """
    Return a bench where LEFT is worth log 2 more than the others of state 4, at temperature 1.

    The first mentor was right twice, of twice: C = (2 + 1) / (2 + 2) = 3/4. The others: 1/2.
    """
    bench = Bench(room(), n_mentors, trust='shaping', estimates_consistency=True)
    bench.state.q[4] = [math.log(2.0), 0.0, 0.0, 0.0]
    bench.state.advice_agreed[0] = bench.state.advice_seen[0] = 3.0
    return bench


def record(as_run, bench, *advice, s=4):
    """Count advice in a state; return how often that of each was right, of how many times."""
    as_run(record_consistency)(s, advised(*advice), bench.kernel_config, bench.state)
    return bench.state.advice_agreed.tolist(), bench.state.advice_seen.tolist()


# The first mentor advises LEFT, the second one RIGHT. Weights of the softmax: 1, 1/2, 1/2, 1/2.
# LEFT: 1 * 3/4 * (1/2)/3 = 18/144. RIGHT: 1/2 * (1/4)/3 * 1/2 = 3/144. DOWN and UP: 1/2 * (1/4)/3
# * (1/2)/3 = 1/144. Together 23/144.
def test_advice_has_been_right_as_often_as_it_is_probable_that_it_is_the_best(as_run):
    agreed, seen = record(as_run, estimating(), LEFT, RIGHT)
    assert agreed == pytest.approx([3 + 18 / 23, 1 + 3 / 23]) and seen == [4.0, 2.0]


def test_the_advice_that_is_more_probably_the_best_counts(as_run):
    bench = estimating()
    m, p = as_run(most_trusted_mentor)(
        4, advised(RIGHT, LEFT), 0, bench.kernel_config, bench.state)
    # RIGHT: 1/2 * 3/4 * 1/6 = 9/144; LEFT: 1 * 1/12 * 1/2 = 6/144; the others 1/144 each.
    assert (m, p) == (0, pytest.approx(9 / 17))
    assert bench.state.confidences.tolist() == pytest.approx([9 / 17, 6 / 17])


def test_of_two_with_the_same_advice_the_more_consistent_one_counts(as_run):
    bench = estimating()
    bench.state.advice_agreed[1], bench.state.advice_seen[0] = 1.0, 5.0
    m, _ = as_run(most_trusted_mentor)(4, advised(UP, UP), 0, bench.kernel_config, bench.state)
    assert m == 1


def test_the_consistency_is_the_mean_of_a_belief_that_begins_with_one_of_each(as_run):
    bench = estimating(3)
    assert [as_run(estimated_consistency)(m, bench.state) for m in range(3)] == [0.75, 0.5, 0.5]


def test_who_gives_no_advice_is_not_counted(as_run):
    agreed, seen = record(as_run, estimating(), -1, LEFT)
    assert agreed == pytest.approx([3.0, 1 + 1 * 0.5 / (0.5 + 3 * 0.5 / 6)])
    assert seen == [3.0, 2.0]


def test_where_nothing_is_known_the_estimate_stays_as_it_is(as_run):
    bench = estimating(1)
    bench.state.q[4] = 0.0
    agreed, seen = record(as_run, bench, UP)
    assert agreed == [3.75] and seen == [4.0]  # 3.75 / 5 = 3/4
    assert as_run(estimated_consistency)(0, bench.state) == pytest.approx(0.75)


def test_wrong_advice_may_be_any_other_action_of_the_state_alone(as_run):
    bench = Bench(corridor(), trust='shaping', estimates_consistency=True)
    agreed, _ = record(as_run, bench, RIGHT, s=1)  # LEFT and RIGHT: 1/2 each
    assert agreed == [1.5]
    agreed, _ = record(as_run, bench, RIGHT, s=0)  # there is no other one
    assert agreed == [2.5]


def test_mentors_that_agree_are_taken_for_right_and_the_one_against_them_for_wrong(as_run):
    bench = Bench(room(), 3, trust='shaping', estimates_consistency=True)
    for _ in range(50):
        record(as_run, bench, UP, UP, DOWN)
    consistency = [as_run(estimated_consistency)(m, bench.state) for m in range(3)]
    assert min(consistency[:2]) > 0.8 and consistency[2] < 0.2


@pytest.mark.parametrize('estimates, counts', [(True, [1.5, 2.0]), (False, [1.0, 1.0])])
def test_a_learning_step_counts_the_advice_of_its_state(as_run, estimates, counts):
    bench = Bench(room(), trust='shaping', estimates_consistency=estimates)
    as_run(learn)(4, LEFT, -1.0, 3, UP, False, advised(UP), 0.5, bench.kernel_config, bench.state)
    assert [bench.state.advice_agreed[0], bench.state.advice_seen[0]] == counts
