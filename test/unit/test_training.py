# SPDX-License-Identifier: Apache-2.0
"""Training in one process."""

from dataclasses import replace

from bar_grid_training import PRESETS, trained
import numpy as np
import pytest
from tiny_worlds import room

from comply_ros.learner import training
from comply_ros.learner.presets import find_method, METHODS
from comply_ros.learner.training import Training
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy


@pytest.mark.parametrize('profile, name', PRESETS)
def test_compiled_and_plain_give_the_same_bits(monkeypatch, profile, name):
    compiled, results = trained(name, profile)
    monkeypatch.setattr(training, 'specialized', lambda kernel, *arguments: kernel)
    plain, plain_results = trained(name, profile)
    assert plain.state.digest() == compiled.state.digest()
    assert repr(plain_results) == repr(results)  # repr, because nan is not equal to itself


@pytest.mark.parametrize('profile, name', PRESETS)
def test_the_seed_decides_everything(profile, name):
    digests = [trained(name, profile, seed=seed)[0].state.digest() for seed in (3, 3, 4)]
    assert digests[0] == digests[1] != digests[2]


def test_the_size_of_a_block_of_draws_changes_nothing(monkeypatch):
    expected = trained('beta_implicit', 'report')[0].state.digest()
    monkeypatch.setattr('comply_ros.numerics.rng.BLOCK', 7)
    assert trained('beta_implicit', 'report')[0].state.digest() == expected


def test_measuring_iterations_learn_nothing_but_change_the_schedules():
    learning, _ = trained('vanishing', 'published', iterations=1)
    assert np.unique(learning.state.q).tolist() == [-np.inf, 0.0]
    assert learning.state.departures.max() == 1.0
    assert learning.state.scheduled_confidence[0] == pytest.approx(0.9 * 0.99)
    assert trained('vanishing', 'report', iterations=1)[0].state.departures.max() > 1.0


def test_returns_and_steps_are_those_of_the_episodes():
    world = room(intended=1.0, limit=30, starts=(5,))
    up = np.full(9, 3, dtype=np.int8)
    config = replace(METHODS['report']['constant'], confidence=1.0, episodes=3)
    learning = Training(world, up, config, seed=0)
    result = learning.iterate()
    assert (result.number, result.mean_return, result.steps) == (1, 10.0, 3)
    assert result.confidence == 1.0
    assert (learning.iterations_done, learning.agent.steps) == (1, 3)
    assert learning.returns.tolist() == [10.0] * 3
    assert learning.lengths.tolist() == [1, 1, 1]


def test_a_truncated_state_has_a_value():
    # From state 0 with one step only: q[0, a] learns towards q of where it led, not towards 0.
    world = room(intended=1.0, limit=1, starts=(0,))
    config = replace(METHODS['report']['sarsa'], initial_value=5.0, episodes=1,
                     learning_rate=1.0, discount=1.0)
    learning = Training(world, np.full(9, -1), config, seed=0)
    assert learning.iterate().mean_return == -1.0
    assert sorted(learning.state.q[0][1::2].tolist()) == [4.0, 5.0]


def test_a_learner_with_an_optimal_mentor_learns():
    world = World(read_map('free_grid', 'report'))
    learning = Training(world, optimal_policy(world), find_method('beta_implicit', 'report'), 0)
    returns = [learning.iterate().mean_return for _ in range(60)]
    assert np.mean(returns[-20:]) > -0.9


def test_a_learner_without_a_mentor_learns():
    world = World(read_map('free_grid', 'published'))
    config = replace(find_method('sarsa', 'published'), temperature=2.0, initial_value=0.0,
                     temperature_factor=0.9)
    learning = Training(world, np.full(121, -1), config, 0)
    returns = [learning.iterate().mean_return for _ in range(60)]
    assert np.mean(returns[:5]) < -5.0 < -1.5 < np.mean(returns[-20:])
