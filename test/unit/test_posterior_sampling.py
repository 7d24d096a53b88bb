# SPDX-License-Identifier: Apache-2.0
"""Draws from the posterior of the outcomes of an action."""

import numpy as np
import pytest
from tiny_worlds import Bench, room

from comply_ros.learner.learner_state import OUTCOMES
from comply_ros.learner.posterior_sampling import draw_outcomes, has_doubled
from comply_ros.numerics.gamma_variate import generator_from
from comply_ros.numerics.jit import compiled
from comply_ros.world.grid import RIGHT


def draws(as_run, counts, number=1):
    """Return draws of the probabilities of the outcomes, `[draw, outcome]`; the last: not seen."""
    bench, drawn = Bench(room(), planner='psrl', unseen_weight=0.5), []
    bench.state.model[4, RIGHT, :len(counts), 0] = counts
    word = as_run(generator_from)(0.3, 0.7)
    for _ in range(number):
        word = as_run(draw_outcomes)(4, RIGHT, word, bench.kernel_config, bench.state)
        drawn.append(bench.state.sampled[4, RIGHT].copy())
    return np.array(drawn)


def test_a_draw_is_a_distribution_over_the_outcomes_seen_and_one_not_seen(as_run):
    drawn = draws(as_run, (3, 1))[0]
    assert drawn.sum() == pytest.approx(1.0)
    assert (drawn[[0, 1, OUTCOMES]] > 0.0).all() and not drawn[2:OUTCOMES].any()


def test_the_draws_have_mean_and_spread_of_the_dirichlet_distribution(as_run):
    # Weights 3, 1 and 0.5: means 3, 1 and 0.5 over 4.5; variance m (1 - m) / 5.5.
    drawn = draws(as_run, (3, 1), number=4000)[:, [0, 1, OUTCOMES]]
    mean = np.array([3.0, 1.0, 0.5]) / 4.5
    assert drawn.mean(axis=0) == pytest.approx(mean, abs=0.015)
    assert drawn.var(axis=0) == pytest.approx(mean * (1.0 - mean) / 5.5, abs=0.004)


def test_after_many_samples_a_draw_is_their_shares(as_run):
    drawn = draws(as_run, (3e8, 1e8))[0]
    assert drawn[[0, 1, OUTCOMES]] == pytest.approx([0.75, 0.25, 0.0], abs=1e-3)


def test_the_bits_of_a_draw_are_those_of_plain_python():
    assert (draws(lambda kernel: kernel, (3, 1), 50) == draws(compiled, (3, 1), 50)).all()



def test_samples_have_doubled_where_they_are_a_power_of_two(as_run):
    assert [n for n in range(1, 70) if as_run(has_doubled)(float(n))] == [1, 2, 4, 8, 16, 32, 64]
