# SPDX-License-Identifier: Apache-2.0
"""Confidence in the mentor: every formula by an example worked by hand."""

import math

import numpy as np
import pytest
from worlds import Bench, corridor, room

from comply_ros.core.compliance import (
    beta_mean,
    confidence,
    confidences,
    highest_but,
    listen_temperature,
    NOTHING,
    sigmoid,
    update_belief,
)
from comply_ros.core.grid import DOWN, RIGHT, UP
from comply_ros.core.memory import CONFIDENCE, DISCARD, LISTEN, STAGE
from comply_ros.core.methods import listening_lead


def p_of(as_run, bench, s=4, advice=RIGHT, step=0):
    """Return the confidence in the advice in state s, at a step of the episode."""
    q, visits, belief, arrivals, schedule, *_ = bench.arrays
    return as_run(confidence)(s, advice, step, bench.numbers, q, visits, belief, arrivals,
                              schedule)


def update(as_run, bench, a, delta, s=4):
    """Change the belief by a step with action a in state s, where RIGHT was advised."""
    memory = bench.memory
    as_run(update_belief)(s, a, RIGHT, delta, bench.numbers, memory.q, memory.belief,
                          memory.arrivals, memory.schedule)


def test_scheduled_trust_is_the_same_everywhere(as_run):  # (3.2), (3.6)
    bench = Bench(room(), trust='scheduled', confidence=0.9)
    assert p_of(as_run, bench) == 0.9
    bench.memory.schedule[CONFIDENCE] = 0.891
    assert p_of(as_run, bench) == 0.891


def test_beta_trust_is_the_mean_of_the_belief(as_run):  # (3.7), section 4.1.1: 8 / (8 + 2)
    bench = Bench(room(), trust='beta', belief_listen=8.0, belief_discard=2.0)
    assert p_of(as_run, bench) == 0.8


@pytest.mark.parametrize('alpha, beta, p', [
    (0.5, 0.055, 0.9009009009009009),  # the report's example of a prior that is almost sure
    (0.0, 0.0, 0.0), (0.0, 3.0, 0.0), (3.0, 0.0, 1.0), (-1.0, 3.0, 0.0), (3.0, -1.0, 1.0),
    (-3.0, 2.0, 0.0), (-3.0, -2.0, 0.0)])
def test_the_mean_of_a_belief_lies_in_0_to_1(as_run, alpha, beta, p):
    assert as_run(beta_mean)(alpha, beta) == pytest.approx(p)


@pytest.mark.parametrize('arrivals, p', [
    (1.0, 0.8807970779778823),  # sigmoid((2 - 1) / 0.5)
    (2.0, 0.9492216)])          # the temperature is 0.5 / 2^0.55 = 0.3415101: sigmoid(2.9281712)
def test_explicit_trust_compares_listening_with_discarding(as_run, arrivals, p):  # (3.11)
    bench = Bench(room(), trust='explicit', trust_rate=0.1, belief_listen=2.0, belief_discard=1.0)
    bench.memory.arrivals[4] = arrivals
    assert p_of(as_run, bench) == pytest.approx(p, abs=1e-7)


def test_the_temperature_of_listening_falls_with_the_visits(as_run):
    numbers = Bench(room(), listen_temperature=0.5).numbers
    assert as_run(listen_temperature)(1.0, numbers) == 0.5
    assert as_run(listen_temperature)(2.0, numbers) == pytest.approx(0.3415101, abs=1e-7)


def test_who_trusts_nobody_has_no_confidence(as_run):
    assert p_of(as_run, Bench(room())) == 0.0


@pytest.mark.parametrize('listened, alpha, beta', [
    (True, 8.2, 2.0),    # 8 + 2 * 2 / 10 * 0.5
    (False, 8.0, 2.8)])  # 2 + 2 * 8 / 10 * 0.5
def test_beta_belief_learns_from_delta(as_run, listened, alpha, beta):  # (3.9), (4.2)
    bench = Bench(room(), trust='beta', trust_rate=2.0)
    a = RIGHT if listened else UP
    update(as_run, bench, a, 0.5)
    assert bench.memory.belief[4].tolist() == pytest.approx([alpha, beta])
    assert bench.memory.belief[3].tolist() == [8.0, 2.0]


@pytest.mark.parametrize('delta, alpha', [(0.01, 8.4), (-3.0, 7.6), (0.0, 8.0)])
def test_published_beta_belief_learns_from_the_sign(as_run, delta, alpha):  # 2 * 2 / 10 * sign
    bench = Bench(room(), trust='beta', trust_rate=2.0, sign_only=True)
    update(as_run, bench, RIGHT, delta)
    assert bench.memory.belief[4, LISTEN] == pytest.approx(alpha)


@pytest.mark.parametrize('bounded, alpha', [(True, 0.0), (False, -12.0)])  # 8 - 2*2/10 * 50
def test_published_belief_is_cut_at_0_and_the_text_is_not(as_run, bounded, alpha):
    bench = Bench(room(), trust='beta', trust_rate=2.0, bounded_belief=bounded)
    update(as_run, bench, RIGHT, -50.0)
    assert bench.memory.belief[4].tolist() == pytest.approx([alpha, 2.0])


def test_a_belief_of_which_nothing_is_left_stays_so(as_run):
    bench = Bench(room(), trust='beta', bounded_belief=True)
    bench.memory.belief[4] = 0.0
    update(as_run, bench, UP, 5.0)
    assert bench.memory.belief[4].tolist() == [0.0, 0.0]
    assert p_of(as_run, bench) == 0.0


@pytest.mark.parametrize('a, both, listen, discard', [
    (RIGHT, True, 1.2, 0.65),  # 0.9 * 1 + 0.1 * 3, and 0.9 * 0.5 + 0.1 * 2
    (RIGHT, False, 1.2, 0.5),
    (UP, False, 1.0, 0.65)])
def test_explicit_values_follow_the_action_values(as_run, a, both, listen, discard):  # (3.12)
    bench = Bench(room(), trust='explicit', trust_rate=0.1, updates_both=both)
    bench.memory.q[4] = [1.0, 3.0, 2.0, -1.0]
    bench.memory.belief[4] = [1.0, 0.5]
    update(as_run, bench, a, 7.0)
    assert bench.memory.belief[4].tolist() == pytest.approx([listen, discard])


def test_in_a_dead_end_there_is_nothing_to_discard_for(as_run):
    bench = Bench(corridor(), trust='explicit', trust_rate=0.1, belief_discard=0.5)
    update(as_run, bench, RIGHT, 1.0, s=0)
    assert bench.memory.belief[0, DISCARD] == 0.5


def test_the_highest_other_value(as_run):
    bench = Bench(room())
    bench.memory.q[4] = [1.0, 3.0, 2.0, -1.0]
    assert as_run(highest_but)(4, RIGHT, bench.memory.q) == 2.0
    assert as_run(highest_but)(4, -1, bench.memory.q) == 3.0
    assert as_run(highest_but)(0, RIGHT, Bench(corridor()).memory.q) == NOTHING


def test_the_lead_of_listening_makes_the_prior(as_run):  # (3.13)
    assert listening_lead(0.9, 0.5) == pytest.approx(1.0986123)  # 0.5 log 9
    assert as_run(sigmoid)(listening_lead(0.9, 0.5) / 0.5) == pytest.approx(0.9)


@pytest.mark.parametrize('x', [-1e6, -745.0, -1.0, 0.0, 1.0, 1e6])
def test_the_sigmoid_never_overflows(as_run, x):
    assert as_run(sigmoid)(x) == pytest.approx(0.5 * (1.0 + math.tanh(x / 2.0)), abs=1e-12)


def test_confidences_are_those_of_every_state():
    bench = Bench(room(), trust='beta')
    bench.memory.belief[DOWN] = [1.0, 3.0]
    p = confidences(bench.method, bench.memory, [-1] * 9)
    assert p == [0.8, 0.8, 0.25] + [0.8] * 6


def test_reused_trust_fades_within_an_episode(as_run):  # 0.8 * 0.5^3
    bench = Bench(room(), trust='scheduled', confidence=0.8, reuse_factor=0.5)
    assert [p_of(as_run, bench, step=step) for step in (0, 1, 3)] == [0.8, 0.4, 0.1]


def test_shaping_multiplies_the_softmax_by_the_odds_of_being_right(as_run):
    # q (1, 2, -inf, 0), temperature 0.5: weights e^-2, 1, 0, e^-4 = 0.1353353, 1, 0, 0.0183156.
    # RIGHT: 0.9 * 1 / (0.9 * 1 + 0.1 * 0.1536509);
    # UP: 0.9 * 0.0183156 / (0.9 * 0.0183156 + 0.1 * 1.1353353)
    bench = Bench(room(), trust='shaping', confidence=0.9, temperature=0.5)
    bench.memory.q[4] = [1.0, 2.0, -np.inf, 0.0]
    assert p_of(as_run, bench, advice=RIGHT) == pytest.approx(0.9832143, abs=1e-6)
    assert p_of(as_run, bench, advice=UP) == pytest.approx(0.1267834, abs=1e-7)


def test_shaping_never_divides_nothing_by_nothing(as_run):
    bench = Bench(room(), trust='shaping', confidence=1.0, temperature=1e-9)
    bench.memory.q[4] = [1.0, 2.0, -np.inf, 0.0]
    assert p_of(as_run, bench, advice=UP) == 0.0


def test_advice_of_no_worth_leaves_the_softmax_as_it_is(as_run):
    """With consistency 1/2, following or not is the same draw as the softmax's own."""
    bench = Bench(room(), trust='shaping', confidence=0.5, temperature=0.5, excludes_refused=True)
    bench.memory.q[4] = [1.0, 2.0, 1.5, 0.0]
    weights = np.exp(bench.memory.q[4] / 0.5)
    assert p_of(as_run, bench, advice=UP) == pytest.approx(weights[UP] / weights.sum())


@pytest.mark.parametrize('stage, step, p', [
    (0, 39, 1.0), (0, 40, 0.0), (1, 29, 1.0), (1, 30, 0.0), (4, 0, 0.0), (9, 0, 0.0)])
def test_a_jump_start_leads_the_first_steps(as_run, stage, step, p):  # 40 steps in 4 stages
    bench = Bench(room(), trust='jump_start', guided_steps=40, guided_stages=4)
    bench.memory.schedule[STAGE] = stage
    assert p_of(as_run, bench, step=step) == p


def test_confidences_in_silence_are_0_for_who_weighs_the_advice_itself():
    bench = Bench(room(), trust='shaping', confidence=0.9)
    p = confidences(bench.method, bench.memory, [RIGHT] + [-1] * 8)
    assert p[0] > 0.5 and p[1:] == [0.0] * 8
