# SPDX-License-Identifier: Apache-2.0
"""Confidence of the baselines, each by an example worked by hand."""

import numpy as np
import pytest
from tiny_worlds import Bench, room

from comply_ros.learner.learner_state import STAGE
from comply_ros.world.grid import RIGHT, UP


def test_reused_trust_fades_within_an_episode(as_run):  # 0.8 * 0.5^3
    bench = Bench(room(), trust='scheduled', confidence=0.8, reuse_factor=0.5)
    assert [bench.confidence(as_run, step=step) for step in (0, 1, 3)] == [0.8, 0.4, 0.1]


def test_shaping_multiplies_the_softmax_by_the_odds_of_being_right(as_run):
    # q (1, 2, -inf, 0), temperature 0.5: weights e^-2, 1, 0, e^-4 = 0.1353353, 1, 0, 0.0183156.
    # RIGHT: 0.9 * 1 / (0.9 * 1 + 0.1 * 0.1536509);
    # UP: 0.9 * 0.0183156 / (0.9 * 0.0183156 + 0.1 * 1.1353353)
    bench = Bench(room(), trust='shaping', confidence=0.9, temperature=0.5)
    bench.memory.q[4] = [1.0, 2.0, -np.inf, 0.0]
    assert bench.confidence(as_run, advice=RIGHT) == pytest.approx(0.9832143, abs=1e-6)
    assert bench.confidence(as_run, advice=UP) == pytest.approx(0.1267834, abs=1e-7)


def test_shaping_never_divides_nothing_by_nothing(as_run):
    bench = Bench(room(), trust='shaping', confidence=1.0, temperature=1e-9)
    bench.memory.q[4] = [1.0, 2.0, -np.inf, 0.0]
    assert bench.confidence(as_run, advice=UP) == 0.0


def test_advice_of_no_worth_leaves_the_softmax_as_it_is(as_run):
    """With consistency 1/2, following or not is the same draw as the softmax's own."""
    bench = Bench(room(), trust='shaping', confidence=0.5, temperature=0.5, excludes_refused=True)
    bench.memory.q[4] = [1.0, 2.0, 1.5, 0.0]
    weights = np.exp(bench.memory.q[4] / 0.5)
    assert bench.confidence(as_run, advice=UP) == pytest.approx(weights[UP] / weights.sum())


@pytest.mark.parametrize('stage, step, p', [
    (0, 39, 1.0), (0, 40, 0.0), (1, 29, 1.0), (1, 30, 0.0), (4, 0, 0.0), (9, 0, 0.0)])
def test_a_jump_start_leads_the_first_steps(as_run, stage, step, p):  # 40 steps in 4 stages
    bench = Bench(room(), trust='jump_start', guided_steps=40, guided_stages=4)
    bench.memory.schedule[STAGE] = stage
    assert bench.confidence(as_run, step=step) == p
