# SPDX-License-Identifier: Apache-2.0
"""Policy evaluation in machine code has the bits of policy evaluation in numpy."""

import subprocess
import sys

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from tiny_tables import machine, tables

from comply_ros.storage.map_files import read_map
from comply_ros.world import planning, policy_values_jit
from comply_ros.world.mdp import World
from comply_ros.world.planning import (
    expected_return,
    policy_probabilities,
    ReferenceReturns,
    uniform_probabilities,
)
from comply_ros.world.policy_values_jit import compiled_policy_values, follow_policy, sweep_steps
from comply_ros.world.table_planning import table_policy_values
from examples import examples


def random_policy(world, seed):
    """Return a policy with some action of each state, or with none."""
    generator = np.random.default_rng(seed)
    actions = generator.integers(-1, world.n_actions, world.n_states)
    exists = world.available[np.arange(world.n_states), actions]
    return policy_probabilities(world, np.where(exists, actions, -1))


def assert_same_bits(world, pi):
    """Compare the values of the starts."""
    expected = table_policy_values(world.table, pi)[world.starts]
    assert compiled_policy_values(world.table, pi)[world.starts].tobytes() == expected.tobytes()


@pytest.mark.parametrize('name', ['frozen_lake_8x8', 'cliff_walking', 'stochastic_windy', 'taxi'])
def test_shipped_worlds_have_the_same_bits(name):
    world = World(read_map(name, 'published'))
    assert_same_bits(world, uniform_probabilities(world))
    for seed in range(5):
        assert_same_bits(world, random_policy(world, seed))


@examples(30)
@given(tables(n_actions=3), st.integers(0, 1000))
def test_random_worlds_have_the_same_bits(table, seed):
    assert_same_bits(World(table), random_policy(World(table), seed))


@pytest.mark.parametrize('limit', [1, 2, 3, 50])
def test_every_sweep_has_the_bits_of_numpy(limit):  # also before the values settle
    world = World(machine(limit))
    assert_same_bits(world, uniform_probabilities(world))


def test_only_what_a_policy_does_is_followed(as_run):
    # A machine that is on runs, for 2 whatever happens; a worn one is stopped, for nothing.
    table = machine()
    order, found = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=bool)
    begin, successor = np.zeros(4, dtype=np.int64), np.zeros(7, dtype=np.int64)
    likely, earned = np.zeros(7), np.zeros(3)
    chances = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    arrays = (order, found, begin, successor, likely, earned)
    count = as_run(follow_policy)(
        chances, table.first, table.successor, table.probability, table.reward,
        np.array([0, 0]), *arrays)
    assert (count, order.tolist(), found.tolist()) == (3, [0, 1, 2], [True, True, True])
    assert begin.tolist() == [0, 2, 3, 3]
    assert (successor[:3].tolist(), likely[:3].tolist()) == ([0, 1, 2], [0.5, 0.5, 1.0])
    assert earned.tolist() == [2.0, 0.0, 0.0]
    found[:] = False
    stopped = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    assert as_run(follow_policy)(
        stopped, table.first, table.successor, table.probability, table.reward,
        np.array([0]), *arrays) == 2  # on and off: never worn


def test_sweeps_end_when_no_value_changes(as_run):
    # From state 1 a step earns 3 and ends in state 0; from state 2 one earns 1 and leads to 1.
    begin, successor, likely = np.array([0, 1, 2, 2]), np.array([1, 0]), np.ones(2)
    arrays = np.array([2, 1, 0]), begin, successor, likely, np.array([1.0, 3.0, 0.0])
    values, other = np.zeros(3), np.zeros(3)
    assert as_run(sweep_steps)(values, other, 100, *arrays) == 3
    assert other.tolist() == [0.0, 3.0, 4.0]
    values, other = np.zeros(3), np.zeros(3)
    assert as_run(sweep_steps)(values, other, 1, *arrays) == 1
    assert other.tolist() == [0.0, 3.0, 1.0]


def test_large_tables_are_evaluated_in_machine_code(monkeypatch):
    world, evaluated = World(machine()), []

    def record(*arguments):
        evaluated.append(True)
        return compiled_policy_values(*arguments)
    monkeypatch.setattr(planning, 'compiled_policy_values', record)
    pi = uniform_probabilities(world)
    small = expected_return(world, pi)
    assert evaluated == []
    monkeypatch.setattr(planning, 'LONG', 7 * 50)  # outcomes, and steps
    assert expected_return(world, pi) == small and evaluated == [True]


def test_without_numba_large_tables_are_evaluated_in_numpy():
    code = ('import sys; sys.modules["numba"] = None; sys.path.insert(0, "test/support");'
            'from comply_ros.world import planning; from comply_ros.world.mdp import World;'
            'from tiny_tables import machine;'
            'planning.LONG = 1; planning.compiled_policy_values = None;'
            'print(planning.ReferenceReturns(World(machine())).optimal_return)')
    done = subprocess.run([sys.executable, '-c', code], check=True, capture_output=True, text=True,
                          cwd=policy_values_jit.__file__.rpartition('comply_ros/world')[0])
    assert float(done.stdout) == ReferenceReturns(World(machine())).optimal_return
