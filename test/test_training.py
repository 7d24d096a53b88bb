# SPDX-License-Identifier: Apache-2.0
"""Many steps in one process."""

from dataclasses import replace

import numpy as np
import pytest
from test_presets import ROWS
from tiny_worlds import room

from comply_ros.learner import training
from comply_ros.learner.presets import find_method, METHODS
from comply_ros.learner.training import Training
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy


def trained(name, profile, iterations=4, seed=3):
    """Return a learner after some iterations on `bar_grid`, and those iterations."""
    world = World(read_map('bar_grid', profile))
    advice = optimal_policy(world)
    advice[::3] = -1  # a mentor that has nothing to say in a third of the states
    learning = Training(world, advice, replace(find_method(name, profile), episodes=5), seed)
    return learning, [learning.iterate() for _ in range(iterations)]


@pytest.mark.parametrize('profile, name', ROWS)
def test_compiled_and_plain_give_the_same_bits(monkeypatch, profile, name):
    compiled, msg = trained(name, profile)
    monkeypatch.setattr(training, 'compiled', lambda kernel: kernel)
    plain, repeated = trained(name, profile)
    assert plain.memory.digest() == compiled.memory.digest()
    assert repr(repeated) == repr(msg)  # repr, because nan is not equal to itself


@pytest.mark.parametrize('profile, name', ROWS)
def test_the_seed_decides_everything(profile, name):
    digests = [trained(name, profile, seed=seed)[0].memory.digest() for seed in (3, 3, 4)]
    assert digests[0] == digests[1] != digests[2]


def test_the_size_of_a_block_of_draws_changes_nothing(monkeypatch):
    expected = trained('beta_implicit', 'report')[0].memory.digest()
    monkeypatch.setattr('comply_ros.numerics.rng.BLOCK', 7)
    assert trained('beta_implicit', 'report')[0].memory.digest() == expected


def test_measuring_iterations_learn_nothing_but_cool():
    learning, _ = trained('vanishing', 'published', iterations=1)
    assert np.unique(learning.memory.q).tolist() == [-np.inf, 0.0]
    assert learning.memory.arrivals.max() == 1.0
    assert learning.memory.schedule[0] == pytest.approx(0.9 * 0.99)
    assert trained('vanishing', 'report', iterations=1)[0].memory.arrivals.max() > 1.0


def test_returns_and_steps_are_those_of_the_episodes():
    world = room(intended=1.0, limit=30, starts=(5,))
    up = np.full(9, 3, dtype=np.int8)
    row = replace(METHODS['report']['constant'], confidence=1.0, episodes=3)
    learning = Training(world, up, row, seed=0)
    iteration = learning.iterate()
    assert (iteration.number, iteration.mean_return, iteration.steps) == (1, 10.0, 3)
    assert iteration.confidence == 1.0
    assert learning.lengths.tolist() == [1, 1, 1]


def test_a_truncated_state_still_counts():
    # From state 0 with one step only: q[0, a] learns towards q of where it led, not towards 0.
    world = room(intended=1.0, limit=1, starts=(0,))
    row = replace(METHODS['report']['sarsa'], initial_value=5.0, episodes=1,
                  learning_rate=1.0, discount=1.0)
    learning = Training(world, np.full(9, -1), row, seed=0)
    iteration = learning.iterate()
    assert iteration.mean_return == -1.0
    assert sorted(learning.memory.q[0][1::2].tolist()) == [4.0, 5.0]


def test_a_learner_with_an_optimal_mentor_learns():
    world = World(read_map('free_grid', 'report'))
    learning = Training(world, optimal_policy(world), find_method('beta_implicit', 'report'), 0)
    returns = [learning.iterate().mean_return for _ in range(60)]
    assert np.mean(returns[-20:]) > -0.9


def test_a_learner_alone_learns():
    world = World(read_map('free_grid', 'published'))
    row = replace(find_method('sarsa', 'published'), temperature=2.0, initial_value=0.0,
                  temperature_factor=0.9)
    learning = Training(world, np.full(121, -1), row, 0)
    returns = [learning.iterate().mean_return for _ in range(60)]
    assert np.mean(returns[:5]) < -5.0 < -1.5 < np.mean(returns[-20:])
