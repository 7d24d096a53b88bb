# SPDX-License-Identifier: Apache-2.0
"""Dynamic programming, with numbers worked out by hand in the corridor `..G`."""

from dataclasses import replace

import numpy as np
import pytest
from tiny_worlds import corridor, grid

from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import LEFT, RIGHT, UP
from comply_ros.world.mdp import World
from comply_ros.world.planning import (
    action_values,
    expected_return,
    greedy,
    optimal_policy,
    optimal_values,
    policy_probabilities,
    policy_values,
    ReferenceReturns,
    sweeps_until,
    uniform_probabilities,
    value_iteration,
)


def test_action_values_look_one_step_ahead():  # (2.10), (2.12)
    q = action_values(corridor(), np.array([5.0, 7.0, 0.0]))
    assert q[1, RIGHT] == pytest.approx(0.8 * 10 + 0.2 * (-1 + 5))  # 8.8
    assert q[1, LEFT] == pytest.approx(0.8 * (-1 + 5) + 0.2 * 10)  # 5.2
    assert q[0, RIGHT] == pytest.approx(-1 + 7)  # its only action cannot slip
    assert q[0, LEFT] == -np.inf


def test_discount_weighs_what_follows():  # (2.12) with gamma 0.5
    q = action_values(corridor(), np.array([5.0, 7.0, 0.0]), discount=0.5)
    assert q[1, RIGHT] == pytest.approx(0.8 * 10 + 0.2 * (-1 + 2.5))  # 8.3


def test_policy_evaluation_sweeps_once_a_step():  # (2.11)
    # One step from state 1: right 0.8*10 + 0.2*-1 = 7.8, left 0.8*-1 + 0.2*10 = 1.2, mean 4.5;
    # from state 0: -1. Two steps from state 1: (0.5*10) + 0.5*(-1 + -1) = 4.
    one, two = (corridor(starts=(1,), limit=limit) for limit in (1, 2))
    assert expected_return(one, uniform_probabilities(one)) == pytest.approx(4.5)
    assert expected_return(two, uniform_probabilities(two)) == pytest.approx(4.0)


def test_policy_improvement_takes_the_first_best_action():  # (2.13), (3.5)
    q = np.array([[1.0, 3.0, 3.0, 2.0], [-np.inf, -2.0, -np.inf, -2.0], [9.0, 9.0, 9.0, 9.0]])
    assert greedy(q, np.array([True, True, False])).tolist() == [RIGHT, RIGHT, -1]


def test_value_iteration_solves_the_corridor():  # (2.9), (2.14): V0 = V1 - 1, V1 = 7.8 + 0.2 V0
    assert optimal_values(corridor()) == pytest.approx([8.5, 9.5, 0.0])
    assert optimal_policy(corridor()).tolist() == [RIGHT, RIGHT, -1]


@pytest.mark.parametrize('profile, value', [('report', 5.83937), ('published', 5.83972)])
def test_the_optimal_return_of_maze_is_that_of_the_report(profile, value):
    world = World(read_map('maze', profile))
    values = optimal_values(world)
    assert values[0] == pytest.approx(5.8397, abs=5e-4)
    assert values[world.starts] == pytest.approx(value, abs=1e-5)


@pytest.mark.parametrize('profile, value', [('report', -112.0), ('published', -71.6)])
def test_the_random_return_of_maze_is_what_the_report_measured(profile, value):
    reference = ReferenceReturns(World(read_map('maze', profile)))
    assert reference.random_return == pytest.approx(value, abs=2)


def test_optimality_is_linear_between_random_and_optimal():  # section 4.3.1
    reference = ReferenceReturns(corridor())
    low, high = reference.random_return, reference.optimal_return
    assert reference.optimality(low) == 0.0
    assert reference.optimality(high) == 1.0
    assert reference.optimality((low + high) / 2) == pytest.approx(0.5)
    assert reference.return_of(optimal_policy(corridor())) == high


def test_cells_without_a_way_to_the_goal_are_not_free():
    world = World(grid('...#.', '..##.', '..G##', starts=(0,)))
    assert world.free.nonzero()[0].tolist() == [0, 1, 5, 6, 10, 11, 12]
    assert optimal_values(world)[[9, 14]].tolist() == [0.0, 0.0]
    assert optimal_policy(world)[[9, 14]].tolist() == [-1, -1]


def test_where_the_random_policy_is_optimal_there_is_no_optimality():
    reference = ReferenceReturns(World(grid('.G')))
    assert reference.optimal_return == reference.random_return == 10.0
    assert reference.optimality(10.0) is None


def test_a_policy_without_advice_acts_at_random():
    world = corridor()
    no_advice = np.full(3, -1, dtype=np.int8)
    assert policy_probabilities(world, no_advice)[1].tolist() == [0.5, 0.5, 0.0, 0.0]
    assert ReferenceReturns(world).return_of(no_advice) == ReferenceReturns(world).random_return


def test_returns_count_the_step_limit_and_obstacles():
    world = World(grid('.#', '.G', starts=(0,), limit=3, intended=1.0))
    pi = policy_probabilities(world, np.array([UP, -1, RIGHT, -1], dtype=np.int8))
    assert expected_return(world, pi) == pytest.approx(-1 - 5 - 5)


def test_value_iteration_stops_when_little_changes():  # (2.23): below 0.1 % of the first change
    assert sweeps_until(0.001, [10.0, 1.0, 0.011, 0.009, 0.0]) == 4
    assert sweeps_until(0.001, [10.0, 1.0]) is None


def test_value_iteration_yields_every_sweep():  # (2.14) in `..G`: 10*0.8 - 0.2, then -1 + 7.8
    sweeps = value_iteration(corridor())
    values, change = next(sweeps)
    assert values.tolist() == pytest.approx([-1.0, 7.8, 0.0]) and change == pytest.approx(7.8)
    values, change = next(sweeps)
    assert values.tolist() == pytest.approx([6.8, 7.6, 0.0]) and change == pytest.approx(7.8)


def test_the_value_of_a_policy_in_every_state():  # one step, right: -1 from 0, 7.8 from 1
    world = corridor(limit=1)
    pi = policy_probabilities(world, np.array([RIGHT, RIGHT, -1]))
    assert policy_values(world, pi).tolist() == pytest.approx([-1.0, 7.8, 0.0])


def test_planning_knows_whether_slips_bump():
    # Over `...` with an obstacle above 1 (obstacle -5): right from 1 is 0.8 * 7 + 0.2 * (-1 + 2).
    rows = grid('.#G', '...')
    values = np.array([2.0, 0.0, 8.0, 0.0, 0.0, 0.0])
    kept, bumps = (action_values(World(replace(rows, slips_bump=each)), values)[1, RIGHT]
                   for each in (False, True))
    assert kept == pytest.approx(0.8 * 7 + 0.2 * 1)
    assert bumps == pytest.approx(0.8 * 7 + 0.1 * 1 + 0.1 * -5)


@pytest.mark.parametrize('slips_bump', [False, True])
def test_policy_values_are_the_mean_of_action_values(slips_bump):
    world = World(replace(grid('.#G', '...', limit=1), slips_bump=slips_bump))
    pi = uniform_probabilities(world)
    q = np.where(world.available, action_values(world, np.zeros(6)), 0.0)
    assert policy_values(world, pi)[world.free].tolist() == pytest.approx(
        (pi * q).sum(axis=1)[world.free].tolist())


def test_the_random_return_of_maze_as_run_is_what_the_published_runs_measured():  # -69.1
    world = World(read_map('maze_as_run', 'published'))
    assert ReferenceReturns(world).random_return == pytest.approx(-69.07, abs=0.005)
