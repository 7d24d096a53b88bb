# SPDX-License-Identifier: Apache-2.0
"""Training in one process."""

from dataclasses import replace

from bar_grid_training import (
    FOR_SEVERAL,
    own_code,
    PRESETS,
    trained,
    use_plain_kernels,
    use_shared_code,
)
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from tiny_tables import frozen_lake, machine, tables
from tiny_worlds import room

from comply_ros.learner.presets import find_method, METHODS
from comply_ros.learner.training import Training
from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import MapError
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy, ReferenceReturns
from comply_ros.world.state_action_spaces import Spaces
from examples import examples


@pytest.mark.parametrize('profile, name', [
    pytest.param(profile, name, marks=pytest.mark.long)
    if own_code(METHODS[profile][name]) & FOR_SEVERAL else (profile, name)
    for profile, name in PRESETS])
def test_compiled_and_plain_give_the_same_bits(monkeypatch, profile, name):
    # In plain Python, a planner takes a second for a thousand steps.
    iterations = 1 if METHODS[profile][name].planner != 'none' else 4
    compiled, results = trained(name, profile, iterations)
    use_plain_kernels(monkeypatch)
    plain, plain_results = trained(name, profile, iterations)
    assert plain.state.digest() == compiled.state.digest()
    assert repr(plain_results) == repr(results)  # repr, because nan is not equal to itself


@pytest.mark.parametrize('profile, name', PRESETS)
def test_the_seed_decides_everything(monkeypatch, profile, name):
    use_shared_code(monkeypatch, METHODS[profile][name])
    digests = [trained(name, profile, 2, seed)[0].state.digest() for seed in (3, 3, 4)]
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


def table_digest(table, name, seed):
    """Return the digest of a short training of a published preset in a table."""
    world = World(table)
    advice = optimal_policy(world)
    advice[::3] = -1
    config = replace(find_method(name, 'published'), episodes=4)
    learning = Training(world, advice, config, seed)
    results = [learning.iterate() for _ in range(3)]
    return learning.state.digest(), repr(results)


ALL = sorted(METHODS['published'])
WITH_SHARED_CODE = [name for name in ALL if not own_code(METHODS['published'][name])]


# Compiled for their number, and with loops. The other methods have code of their own: with a grid,
# it is compiled above, and what is special in a table is special in all methods.
@pytest.mark.parametrize('n_actions, names', [
    (4, WITH_SHARED_CODE), pytest.param(3, ALL, marks=pytest.mark.long),
    pytest.param(20, ALL, marks=pytest.mark.long)])
@given(data=st.data())
@examples(25)
def test_compiled_and_plain_give_the_same_bits_in_any_table(n_actions, names, data):
    table = data.draw(tables(n_actions=n_actions))
    name = data.draw(st.sampled_from(names))
    seed = data.draw(st.integers(0, 100))
    compiled = table_digest(table, name, seed)
    with pytest.MonkeyPatch.context() as patch:
        use_plain_kernels(patch)
        assert table_digest(table, name, seed) == compiled


def test_the_mean_return_in_a_table_is_the_expected_one(monkeypatch):
    use_plain_kernels(monkeypatch)
    world = World(machine(limit=3))  # run, run, run: 2 + (2 - 0.25) / 2 + ...
    runs = np.array([0, 0, -1])
    config = replace(find_method('constant', 'report'), confidence=1.0, episodes=20_000)
    learning = Training(world, runs, config, seed=0)
    expected = ReferenceReturns(world).return_of(runs)
    assert expected == pytest.approx(2 + 0.5 * 2.875 + 0.5 * (-0.25 - 0.75 * 0.25))
    assert learning.iterate().mean_return == pytest.approx(expected, abs=0.05)


def test_a_learner_crosses_a_frozen_lake_with_its_mentor():
    world = World(frozen_lake(('SFFF', 'FHFH', 'FFFH', 'HFFG')))
    learning = Training(world, optimal_policy(world), find_method('beta_implicit', 'published'), 0)
    returns = [learning.iterate().mean_return for _ in range(60)]
    assert np.mean(returns[-30:]) > 0.7  # without a mentor, 0.02


def test_without_a_model_no_training_is_in_one_process():
    world = World(Spaces(3, ('go', 'wait'), 10))
    with pytest.raises(MapError, match='got one without a model'):
        Training(world, np.full(3, -1), find_method('sarsa', 'report'), 0)
