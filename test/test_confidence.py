# SPDX-License-Identifier: Apache-2.0
"""Confidence in the mentor: every formula by an example worked by hand."""

import math

import numpy as np
import pytest
from tiny_worlds import Bench, room

from comply_ros.learner import confidence
from comply_ros.learner.confidence import confidence_map, listen_temperature, sigmoid
from comply_ros.learner.learner_state import CONFIDENCE
from comply_ros.learner.presets import listening_lead
from comply_ros.world.grid import DOWN, RIGHT


def test_scheduled_trust_is_the_same_everywhere(as_run):  # (3.2), (3.6)
    bench = Bench(room(), trust='scheduled', confidence=0.9)
    assert bench.confidence(as_run) == 0.9
    bench.memory.schedule[CONFIDENCE] = 0.891
    assert bench.confidence(as_run) == 0.891


def test_beta_trust_is_the_mean_of_the_belief(as_run):  # (3.7), section 4.1.1: 8 / (8 + 2)
    bench = Bench(room(), trust='beta', belief_listen=8.0, belief_discard=2.0)
    assert bench.confidence(as_run) == 0.8


@pytest.mark.parametrize('arrivals, p', [
    (1.0, 0.8807970779778823),  # sigmoid((2 - 1) / 0.5)
    (2.0, 0.9492216)])          # the temperature is 0.5 / 2^0.55 = 0.3415101: sigmoid(2.9281712)
def test_explicit_trust_compares_listening_with_discarding(as_run, arrivals, p):  # (3.11)
    bench = Bench(room(), trust='explicit', trust_rate=0.1, belief_listen=2.0, belief_discard=1.0)
    bench.memory.arrivals[4] = arrivals
    assert bench.confidence(as_run) == pytest.approx(p, abs=1e-7)


def test_the_temperature_of_listening_falls_with_the_visits(as_run):
    numbers = Bench(room(), listen_temperature=0.5).numbers
    assert as_run(listen_temperature)(1.0, numbers) == 0.5
    assert as_run(listen_temperature)(2.0, numbers) == pytest.approx(0.3415101, abs=1e-7)


def test_who_trusts_nobody_has_no_confidence(as_run):
    assert Bench(room()).confidence(as_run) == 0.0


def test_the_lead_of_listening_makes_the_prior(as_run):  # (3.13)
    assert listening_lead(0.9, 0.5) == pytest.approx(1.0986123)  # 0.5 log 9
    assert as_run(sigmoid)(listening_lead(0.9, 0.5) / 0.5) == pytest.approx(0.9)


@pytest.mark.parametrize('x', [-1e6, -745.0, -1.0, 0.0, 1.0, 1e6])
def test_the_sigmoid_never_overflows(as_run, x):
    assert as_run(sigmoid)(x) == pytest.approx(0.5 * (1.0 + math.tanh(x / 2.0)), abs=1e-12)


def test_confidences_are_those_of_every_state():
    bench = Bench(room(), trust='beta')
    bench.memory.belief[DOWN, :2] = [1.0, 3.0]
    p = confidence_map(bench.method, bench.memory, [-1] * 9)
    assert p.tolist() == [0.8, 0.8, 0.25] + [0.8] * 6


def test_confidences_in_silence_are_0_for_who_weighs_the_advice_itself():
    bench = Bench(room(), trust='shaping', confidence=0.9)
    p = confidence_map(bench.method, bench.memory, [RIGHT] + [-1] * 8)
    assert p[0] > 0.5 and p[1:].tolist() == [0.0] * 8


@pytest.mark.parametrize('settings', [
    {'trust': 'none'}, {'trust': 'scheduled', 'confidence': 0.7}, {'trust': 'beta'},
    {'trust': 'explicit', 'trust_rate': 0.1}, {'trust': 'shaping', 'confidence': 0.9},
    {'trust': 'beta', 'learns_prior': True}, {'trust': 'jump_start'}, {'trust': 'head_start'}],
    ids=str)
@pytest.mark.parametrize('met', [0.0, 0.5, 1.0])
def test_confidences_are_what_the_kernel_says_state_by_state(settings, met):
    bench, generator = Bench(room(), **settings), np.random.Generator(np.random.PCG64(1))
    there = generator.random(9) < met
    advice = np.where(there, generator.integers(-1, 4, size=9), -1)
    for array in (bench.memory.belief, bench.memory.visits, bench.memory.arrivals):
        array[there] += generator.integers(0, 3, size=array[there].shape)
    bench.memory.arrivals[there & (generator.random(9) < 0.5)] = 1.0
    silent = settings['trust'] in ('shaping', 'head_start')
    expected = [0.0 if silent and msg < 0 else bench.confidence(lambda each: each, s, int(msg))
                for s, msg in enumerate(advice)]
    assert confidence_map(bench.method, bench.memory, advice).tolist() == expected


@pytest.mark.parametrize('trust, most', [('beta', 3), ('explicit', 3), ('scheduled', 1),
                                         ('none', 1), ('shaping', 2), ('head_start', 2)])
def test_confidences_of_states_that_are_alike_are_computed_once(monkeypatch, trust, most):
    bench, computed = Bench(room(), trust=trust, trust_rate=0.1), []
    bench.memory.belief[[2, 5], 0] += 1.0
    monkeypatch.setattr(confidence, 'confidence',
                        lambda s, *arguments: computed.append(s) or 0.5)
    confidence_map(bench.method, bench.memory, [-1, 0, -1, -1, 2, -1, -1, -1, -1])
    assert len(computed) == most
