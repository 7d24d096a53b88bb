# SPDX-License-Identifier: Apache-2.0
"""The MDP in arrays, and moves in it."""

from dataclasses import replace

import numpy as np
import pytest
from tiny_worlds import corridor, grid, room

from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP
from comply_ros.world.mdp import first_state, taken_action, World


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
