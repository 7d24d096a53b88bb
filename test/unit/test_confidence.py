# SPDX-License-Identifier: Apache-2.0
"""Confidence in the mentor: every formula by an example worked by hand."""

import math

import numpy as np
import pytest
from tiny_worlds import advised, Bench, room

from comply_ros.learner import confidence
from comply_ros.learner.confidence import (
    confidence_map,
    listen_temperature,
    most_trusted_mentor,
    sigmoid,
)
from comply_ros.learner.presets import listening_lead
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP


def test_scheduled_trust_is_the_same_everywhere(as_run):  # (3.2), (3.6)
    bench = Bench(room(), trust='scheduled', confidence=0.9)
    assert bench.confidence(as_run) == 0.9
    bench.state.scheduled_confidence[0] = 0.891
    assert bench.confidence(as_run) == 0.891


def test_beta_trust_is_the_mean_of_the_belief(as_run):  # (3.7), section 4.1.1: 8 / (8 + 2)
    bench = Bench(room(), trust='beta', belief_listen=8.0, belief_discard=2.0)
    assert bench.confidence(as_run) == 0.8


@pytest.mark.parametrize('departures, p', [
    (1.0, 0.8807970779778823),  # sigmoid((2 - 1) / 0.5)
    (2.0, 0.9492216)])          # the temperature is 0.5 / 2^0.55 = 0.3415101: sigmoid(2.9281712)
def test_explicit_trust_compares_listening_with_discarding(as_run, departures, p):  # (3.11)
    bench = Bench(room(), trust='explicit', trust_rate=0.1, belief_listen=2.0, belief_discard=1.0)
    bench.state.departures[4] = departures
    assert bench.confidence(as_run) == pytest.approx(p, abs=1e-7)


def test_the_temperature_of_listening_falls_with_the_visits(as_run):
    config = Bench(room(), listen_temperature=0.5).kernel_config
    assert as_run(listen_temperature)(1.0, config) == 0.5
    assert as_run(listen_temperature)(2.0, config) == pytest.approx(0.3415101, abs=1e-7)


def test_a_learner_without_trust_has_no_confidence(as_run):
    assert Bench(room()).confidence(as_run) == 0.0


def test_the_lead_of_listening_makes_the_prior(as_run):  # (3.13)
    assert listening_lead(0.9, 0.5) == pytest.approx(1.0986123)  # 0.5 log 9
    assert as_run(sigmoid)(listening_lead(0.9, 0.5) / 0.5) == pytest.approx(0.9)


@pytest.mark.parametrize('x', [-1e6, -745.0, -1.0, 0.0, 1.0, 1e6])
def test_the_sigmoid_never_overflows(as_run, x):
    assert as_run(sigmoid)(x) == pytest.approx(0.5 * (1.0 + math.tanh(x / 2.0)), abs=1e-12)


def test_policy_reuse_fades_within_an_episode(as_run):  # 0.8 * 0.5^3
    bench = Bench(room(), trust='scheduled', confidence=0.8, reuse_factor=0.5)
    assert [bench.confidence(as_run, step=step) for step in (0, 1, 3)] == [0.8, 0.4, 0.1]


@pytest.mark.parametrize('stage, step, p', [
    (0, 39, 1.0), (0, 40, 0.0), (1, 29, 1.0), (1, 30, 0.0), (4, 0, 0.0), (9, 0, 0.0)])
def test_a_jump_start_guides_the_first_steps(as_run, stage, step, p):  # 40 steps in 4 stages
    bench = Bench(room(), trust='jump_start', guided_steps=40, guided_stages=4)
    bench.state.guided_stage[0] = stage
    assert bench.confidence(as_run, step=step) == p


@pytest.mark.parametrize('follows_majority, advice, mentor', [
    (False, (LEFT, RIGHT, RIGHT, UP), 0),  # the highest value
    (True, (LEFT, RIGHT, RIGHT, UP), 1),   # two votes against one; of the two, the first
    (True, (LEFT, RIGHT, RIGHT, LEFT), 0),  # two against two: the highest value
    (True, (UP, LEFT, RIGHT, RIGHT), 2),
    (True, (-1, UP, -1, RIGHT), 3),        # those without advice have no vote
    (True, (-1, -1, -1, -1), -1)])
def test_in_a_majority_vote_the_advice_with_the_most_votes_counts(
        as_run, follows_majority, advice, mentor):
    bench = Bench(room(), 4, trust='scheduled', confidence=0.7, follows_majority=follows_majority)
    bench.state.q[4] = [3.0, 2.0, 0.0, 1.0]  # left, right, down, up
    assert as_run(most_trusted_mentor)(
        4, advised(*advice), 0, bench.kernel_config, bench.state) == (
            mentor, 0.7 if mentor >= 0 else 0.0)


def test_within_a_majority_the_highest_confidence_counts(as_run):
    bench = Bench(room(), 4, trust='beta', follows_majority=True)  # 8 and 2, so 0.8
    bench.state.belief[2 * 9 + 4, 0] = 18.0  # 18 / 20
    bench.state.belief[3 * 9 + 4, 0] = 38.0  # 38 / 40, but alone
    found = as_run(most_trusted_mentor)(
        4, advised(RIGHT, RIGHT, RIGHT, LEFT), 0, bench.kernel_config, bench.state)
    assert found == (2, 0.9)
    assert bench.state.confidences.tolist() == [0.8, 0.8, 0.9, 0.95]


def test_a_confidence_map_has_the_confidence_of_every_state():
    bench = Bench(room(), trust='beta')
    bench.state.belief[DOWN, :2] = [1.0, 3.0]
    p = confidence_map(bench.config, bench.state, [-1] * 9)
    assert p.tolist() == [0.8, 0.8, 0.25] + [0.8] * 6


def test_where_trust_depends_on_the_advice_the_confidence_without_advice_is_0():
    bench = Bench(room(), trust='shaping', confidence=0.9)
    p = confidence_map(bench.config, bench.state, [RIGHT] + [-1] * 8)
    assert p[0] > 0.5 and p[1:].tolist() == [0.0] * 8


@pytest.mark.parametrize('settings', [
    {'trust': 'none'}, {'trust': 'scheduled', 'confidence': 0.7}, {'trust': 'beta'},
    {'trust': 'explicit', 'trust_rate': 0.1}, {'trust': 'shaping', 'confidence': 0.9},
    {'trust': 'shaping', 'estimates_consistency': True},
    {'trust': 'beta', 'learns_prior': True}, {'trust': 'jump_start'}, {'trust': 'head_start'},
    {'trust': 'track_record', 'learns_model': True}, {'trust': 'returns'}],
    ids=str)
@pytest.mark.parametrize('share', [0.0, 0.5, 1.0])
def test_a_confidence_map_is_what_the_kernel_returns_state_by_state(settings, share):
    bench, generator = Bench(room(), **settings), np.random.Generator(np.random.PCG64(1))
    state, visited = bench.state, generator.random(9) < share
    advice = np.where(visited, generator.integers(-1, 4, size=9), -1)
    for array in (state.belief, state.visits, state.departures):
        array[visited] += generator.integers(0, 3, size=array[visited].shape)
    state.departures[visited & (generator.random(9) < 0.5)] = 1.0
    weighs_action = settings['trust'] in ('shaping', 'head_start', 'track_record')
    expected = [0.0 if weighs_action and action < 0
                else bench.confidence(lambda kernel: kernel, s, int(action))
                for s, action in enumerate(advice)]
    assert confidence_map(bench.config, state, advice).tolist() == expected


@pytest.mark.parametrize('trust, most', [('beta', 3), ('explicit', 3), ('scheduled', 1),
                                         ('none', 1), ('shaping', 2), ('head_start', 2)])
def test_the_confidence_of_states_that_are_alike_is_computed_once(monkeypatch, trust, most):
    bench, computed = Bench(room(), trust=trust, trust_rate=0.1), []
    bench.state.belief[[2, 5], 0] += 1.0
    monkeypatch.setattr(confidence, 'confidence',
                        lambda s, *arguments: computed.append(s) or 0.5)
    confidence_map(bench.config, bench.state, [-1, 0, -1, -1, 2, -1, -1, -1, -1])
    assert len(computed) == most
