# SPDX-License-Identifier: Apache-2.0
"""The MDP in arrays, and moves in it."""

from dataclasses import replace

import numpy as np
import pytest
from tiny_tables import hall, machine
from tiny_worlds import corridor, grid, room

from comply_ros.numerics.action_values import actions_for_kernels
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP
from comply_ros.world.mdp import (
    action_type,
    drawn_outcome,
    first_state,
    next_state,
    taken_action,
    World,
)
from comply_ros.world.state_action_spaces import Spaces

THREE = actions_for_kernels(3)


def test_moves_lead_to_neighbours_and_never_off_the_grid():
    world = room()
    assert world.successor[4].tolist() == [3, 5, 1, 7]  # left, right, down, up
    assert world.successor[0].tolist() == [-1, 1, -1, 3]
    assert world.reward[5, UP] == 10.0
    assert world.reward[4, UP] == -1.0
    assert world.terminal.nonzero()[0].tolist() == [8]


def test_a_step_against_an_obstacle_costs_its_reward_and_leads_nowhere():
    world = World(grid('..G', '.#.'))
    assert world.successor[0, RIGHT] == 0
    assert world.reward[0, RIGHT] == -5.0
    assert world.successor[4, DOWN] == 4


@pytest.mark.parametrize('u, taken', [
    (0.0, RIGHT), (0.9499, RIGHT),            # (3.4): as meant with 0.95
    (0.9501, LEFT), (0.9666, LEFT),           # the rest, 0.05, in three equal parts
    (0.9667, DOWN), (0.9833, DOWN), (0.9834, UP), (0.999999, UP)])
def test_a_slip_takes_one_of_the_other_actions(as_run, u, taken):
    world = room(intended=0.95)
    assert as_run(taken_action)(4, RIGHT, u, 0.95, world.slips) == taken


@pytest.mark.parametrize('u, taken', [(0.89, RIGHT), (0.91, UP), (0.99999, UP)])
def test_a_corner_has_one_other_action(as_run, u, taken):
    world = room(intended=0.9)
    assert as_run(taken_action)(0, RIGHT, u, 0.9, world.slips) == taken  # (2.22)


def test_where_there_is_no_other_action_nothing_slips(as_run):
    assert as_run(taken_action)(0, RIGHT, 0.999, 0.8, corridor().slips) == RIGHT


@pytest.mark.parametrize('slips_bump, u, taken', [
    (True, 0.81, LEFT), (True, 0.92, UP), (False, 0.81, LEFT), (False, 0.99, LEFT)])
def test_slips_bump_decides_whether_a_slip_can_run_into_an_obstacle(as_run, slips_bump, u, taken):
    world = World(replace(grid('.#G', '...'), slips_bump=slips_bump))
    assert as_run(taken_action)(1, RIGHT, u, 0.8, world.slips) == taken  # the obstacle is above 1


def test_where_only_an_obstacle_is_left_nothing_slips(as_run):
    world = World(replace(grid('#.', '.G'), slips_bump=False))
    assert as_run(taken_action)(0, RIGHT, 0.99, 0.8, world.slips) == RIGHT


@pytest.mark.parametrize('u, start', [(0.0, 4), (0.49, 4), (0.5, 7), (0.999999999, 7)])
def test_starts_are_equally_likely(as_run, u, start):
    assert as_run(first_state)(u, np.array([4, 7], dtype=np.int32)) == start


def test_available_moves_are_computed_once():  # they are looked up in every step
    world = corridor()
    assert world.available.tolist() == [[False, True, False, False], [True, True, False, False],
                                        [True, False, False, False]]
    assert world.available is world.available


def test_a_grid_is_described_as_any_world_is():
    world = corridor()
    assert (world.model, world.n_states, world.n_actions, world.step_limit) == ('grid', 3, 4, 50)
    assert world.action_names == ('left', 'right', 'down', 'up')
    assert world.sha256 == world.grid.sha256
    assert (world.action_type, world.begins.tolist()) == (np.int8, [True, False, False])
    with pytest.raises(TypeError, match='a Grid has no table'):
        world.table  # noqa: B018 - it raises


def test_a_table_is_described_as_any_world_is():
    table = machine(starts=(0, 1))
    world = World(table)
    assert (world.model, world.n_states, world.n_actions, world.step_limit) == ('table', 3, 3, 50)
    assert world.action_names == ('run', 'stop', 'repair')
    assert world.sha256 == table.sha256 and world.table is table
    assert world.available.tolist() == table.available.tolist()
    assert world.terminal.tolist() == [False, False, True]
    assert world.free.tolist() == world.begins.tolist() == [True, True, False]
    assert world.starts.tolist() == [0, 1]
    assert world.successor.size == world.reward.size == world.slips.size == 0
    assert world.positions is None
    places = np.array([[0.0, 0.0], [1.0, 0.5], [2.0, 0.0]])
    assert World(machine(positions=places)).positions is places
    with pytest.raises(TypeError, match='a Table has no grid'):
        world.grid  # noqa: B018 - it raises


def test_a_world_without_a_model_has_states_and_actions_only():
    some = np.array([[True, True], [True, False], [False, False]])
    world = World(Spaces(3, ('go', 'wait'), 10, some))
    assert (world.model, world.n_states, world.n_actions, world.step_limit) == ('none', 3, 2, 10)
    assert world.free.tolist() == [True, True, False]
    assert not world.terminal.any() and not len(world.starts) and not world.begins.any()
    assert World(Spaces(3, ('go', 'wait'), 10)).available.all()


def test_what_can_follow_a_state():
    assert [World(machine()).leads(1, s2) for s2 in range(3)] == [True, True, True]
    assert [World(hall(4, 2)).leads(1, s2) for s2 in range(4)] == [True, False, True, False]
    assert [corridor().leads(0, s2) for s2 in range(3)] == [False, True, False]
    assert World(Spaces(3, ('go',), 10)).leads(0, 2)


@pytest.mark.parametrize('number, kind', [(1, np.int8), (127, np.int8), (128, np.int16)])
def test_actions_are_stored_in_as_few_bytes_as_they_need(number, kind):
    assert action_type(number) is kind


@pytest.mark.parametrize('u, outcome', [
    (0.0, 3), (0.7499, 3), (0.75, 4), (0.999999999, 4)])  # worn, run: 0.75 and 0.25
def test_outcomes_are_drawn_by_their_probabilities(as_run, u, outcome):
    table = machine()
    assert as_run(drawn_outcome)(1, 0, u, table.first, table.probability, THREE) == outcome


def test_rounded_probabilities_leave_the_last_outcome(as_run):
    first, probability = np.array([0, 3]), np.array([0.3, 0.3, 0.4 - 1e-10])
    last = as_run(drawn_outcome)(0, 0, 1.0 - 1e-12, first, probability, actions_for_kernels(1))
    assert last == 2


def test_a_move_in_a_table(as_run):
    arrays = World(machine(limit=7)).arrays()
    move = as_run(next_state)
    assert move(-1, 0, 0, 0.5, arrays) == (0.0, 0, False, False)
    assert move(0, 0, 0, 0.2, arrays) == (2.0, 0, False, False)
    assert move(0, 0, 0, 0.7, arrays) == (2.0, 1, False, False)
    assert move(0, 1, 0, 0.8, arrays) == (-4.0, 2, True, True)
    assert move(6, 1, 2, 0.8, arrays) == (-5.0, 0, False, True)  # the step limit


def test_a_move_in_a_grid(as_run):
    arrays = room(intended=1.0, limit=7).arrays()
    assert as_run(next_state)(0, 5, UP, 0.2, arrays) == (10.0, 8, True, True)
    assert as_run(next_state)(6, 4, UP, 0.2, arrays) == (-1.0, 7, False, True)
