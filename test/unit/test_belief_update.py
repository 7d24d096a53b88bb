# SPDX-License-Identifier: Apache-2.0
"""Updates of the belief about the mentor: every formula by an example worked by hand."""

import pytest
from tiny_worlds import Bench, corridor, room

from comply_ros.learner.belief_update import beta_mean
from comply_ros.learner.learner_state import DISCARD, LISTEN
from comply_ros.world.grid import RIGHT, UP


@pytest.mark.parametrize('alpha, beta, p', [
    (0.5, 0.055, 0.9009009009009009),  # the report's example of a prior that is almost sure
    (0.0, 0.0, 0.0), (0.0, 3.0, 0.0), (3.0, 0.0, 1.0), (-1.0, 3.0, 0.0), (3.0, -1.0, 1.0),
    (-3.0, 2.0, 0.0), (-3.0, -2.0, 0.0)])
def test_the_mean_of_a_belief_lies_in_0_to_1(as_run, alpha, beta, p):
    assert as_run(beta_mean)(alpha, beta) == pytest.approx(p)


@pytest.mark.parametrize('listened, alpha, beta', [
    (True, 8.2, 2.0),    # 8 + 2 * 2 / 10 * 0.5
    (False, 8.0, 2.8)])  # 2 + 2 * 8 / 10 * 0.5
def test_the_beta_belief_learns_from_delta(as_run, listened, alpha, beta):  # (3.9), (4.2)
    bench = Bench(room(), trust='beta', trust_rate=2.0)
    a = RIGHT if listened else UP
    bench.update_belief(as_run, a, 0.5)
    assert bench.state.belief[4, :2].tolist() == pytest.approx([alpha, beta])
    assert bench.state.belief[3, :2].tolist() == [8.0, 2.0]


@pytest.mark.parametrize('delta, alpha', [(0.01, 8.4), (-3.0, 7.6), (0.0, 8.0)])
def test_the_published_beta_belief_learns_from_the_sign_of_delta(as_run, delta, alpha):
    # 8 + 2 * 2 / 10 * sign
    bench = Bench(room(), trust='beta', trust_rate=2.0, sign_only=True)
    bench.update_belief(as_run, RIGHT, delta)
    assert bench.state.belief[4, LISTEN] == pytest.approx(alpha)


@pytest.mark.parametrize('bounded, alpha', [(True, 0.0), (False, -12.0)])  # 8 - 2*2/10 * 50
def test_the_published_belief_is_cut_at_0_and_that_of_the_text_is_not(as_run, bounded, alpha):
    bench = Bench(room(), trust='beta', trust_rate=2.0, bounded_belief=bounded)
    bench.update_belief(as_run, RIGHT, -50.0)
    assert bench.state.belief[4, :2].tolist() == pytest.approx([alpha, 2.0])


def test_a_belief_of_0_and_0_stays_so(as_run):
    bench = Bench(room(), trust='beta', bounded_belief=True)
    bench.state.belief[4] = 0.0
    bench.update_belief(as_run, UP, 5.0)
    assert bench.state.belief[4, :2].tolist() == [0.0, 0.0]
    assert bench.confidence(as_run) == 0.0


@pytest.mark.parametrize('a, both, listen, discard', [
    (RIGHT, True, 1.2, 0.65),  # 0.9 * 1 + 0.1 * 3, and 0.9 * 0.5 + 0.1 * 2
    (RIGHT, False, 1.2, 0.5),
    (UP, False, 1.0, 0.65)])
def test_explicit_values_follow_the_action_values(as_run, a, both, listen, discard):  # (3.12)
    bench = Bench(room(), trust='explicit', trust_rate=0.1, updates_both=both)
    bench.state.q[4] = [1.0, 3.0, 2.0, -1.0]
    bench.state.belief[4, :2] = [1.0, 0.5]
    bench.update_belief(as_run, a, 7.0)
    assert bench.state.belief[4, :2].tolist() == pytest.approx([listen, discard])


def test_in_a_dead_end_the_value_of_discarding_stays(as_run):
    bench = Bench(corridor(), trust='explicit', trust_rate=0.1, belief_discard=0.5)
    bench.update_belief(as_run, RIGHT, 1.0, s=0)
    assert bench.state.belief[0, DISCARD] == 0.5
