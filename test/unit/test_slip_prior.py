# SPDX-License-Identifier: Apache-2.0
"""The size of the prior of slips, by examples worked by hand (docs/methods/model_based.md)."""

import math

import pytest
from tiny_worlds import Bench, room

from comply_ros.learner.learner_state import FIRST_SCORE, HITS, IN_USE, TRIALS
from comply_ros.learner.slip_prior import prior_size, score_sizes
from comply_ros.world.grid import LEFT, RIGHT, UP


def tried_twice(**settings):
    """Return a bench where RIGHT led twice from state 4 to 5, UP once to 7 and LEFT once to 5."""
    bench = Bench(room(), learns_model=True, **settings)
    bench.state.pooled[[HITS, TRIALS]] = 3.0, 4.0  # p = (3 + 1) / (4 + 2) = 2/3
    for a, count, successor in ((RIGHT, 2.0, 5.0), (UP, 1.0, 7.0), (LEFT, 1.0, 5.0)):
        bench.state.model[4, a, 0] = count, successor, -1.0
        bench.state.visits[4, a] += count
    return bench


def scored(as_run, bench, outcome, successor):
    """Score an outcome of RIGHT; return the likelihoods with 1, 2, 4, 8, 16 and 32 samples."""
    as_run(score_sizes)(4, RIGHT, outcome, 0, successor, bench.state)
    return [math.exp(score) for score in bench.state.prior_sizes[FIRST_SCORE:]]


def test_an_outcome_as_usual_is_predicted_best_by_a_small_prior(as_run):
    # One of the two samples of the other actions led to 5 too: o = (1 + 0.1) / (2 + 0.8). The
    # prior gives it 2/3 + o / 3 = 0.797619, and K samples of it (2 + K 0.797619) / (2 + K).
    bench = tried_twice()
    assert scored(as_run, bench, 0, 5.0) == pytest.approx(
        [(2 + size * 0.797619) / (2 + size) for size in (1, 2, 4, 8, 16, 32)])
    assert bench.state.prior_sizes[IN_USE] == 1.0


def test_an_outcome_that_only_another_action_had_is_predicted_best_by_a_large_prior(as_run):
    # o is 1.1 / 2.8 for 7 too: the prior gives it a third of that, 0.130952.
    bench = tried_twice()
    assert scored(as_run, bench, 1, 7.0) == pytest.approx(
        [size * 0.130952 / (2 + size) for size in (1, 2, 4, 8, 16, 32)], rel=1e-5)
    assert bench.state.prior_sizes[IN_USE] == 32.0


def test_an_outcome_that_nobody_had_is_not_impossible(as_run):
    assert scored(as_run, tried_twice(), 1, 1.0)[0] == pytest.approx(0.1 / 2.8 / 3 / 3)


def test_where_no_other_action_was_tried_nothing_is_scored(as_run):
    bench = tried_twice()
    bench.state.model[4, [UP, LEFT]] = 0.0
    assert scored(as_run, bench, 0, 5.0) == [1.0] * 6
    assert bench.state.prior_sizes[IN_USE] == 8.0


def test_of_equally_good_sizes_it_is_eight(as_run):
    bench = tried_twice()
    bench.state.model[4, [UP, LEFT], 0, 1] = 5.0  # all samples led to 5
    bench.state.prior_sizes[FIRST_SCORE:] = [-1.0, 3.0, 1.0, 3.0, 3.0, -2.0]
    bench.state.model[4, RIGHT, 0, 0] = 1e300  # so that each size gives the outcome 1
    bench.state.visits[4, RIGHT] = 1e300
    as_run(score_sizes)(4, RIGHT, 0, 0, 5.0, bench.state)
    assert bench.state.prior_sizes[IN_USE] == 8.0


def test_of_equally_good_sizes_that_are_better_it_is_the_smallest(as_run):
    bench = tried_twice()
    bench.state.model[4, [UP, LEFT]] = 0.0
    bench.state.model[4, UP, 0] = 1.0, 5.0, -1.0
    bench.state.model[4, RIGHT, 0, 0], bench.state.visits[4, RIGHT] = 1e300, 1e300
    bench.state.prior_sizes[FIRST_SCORE:] = [-1.0, 3.0, 1.0, 1.0, 3.0, -2.0]
    as_run(score_sizes)(4, RIGHT, 0, 0, 5.0, bench.state)
    assert bench.state.prior_sizes[IN_USE] == 2.0


@pytest.mark.parametrize('setting, size', [(0.0, 4.0), (16.0, 16.0), (1e-9, 1e-9)])
def test_a_size_that_is_set_is_not_learned(as_run, setting, size):
    bench = tried_twice(slip_prior=setting)
    bench.state.prior_sizes[IN_USE] = 4.0
    assert as_run(prior_size)(bench.kernel_config, bench.state) == size
