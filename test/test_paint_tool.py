# SPDX-License-Identifier: Apache-2.0
"""Strokes over cells, and the arrows that they paint."""

import numpy as np
import pytest
from tiny_worlds import grid

from comply_ros.dashboard.paint_tool import PaintTool, steps_between
from comply_ros.world.grid import DOWN, LEFT, NO_ACTION, RIGHT, UP
from comply_ros.world.mdp import World


@pytest.fixture
def world():
    return World(grid('..G', '.#.', '...'))


def test_a_drag_paints_arrows_along_its_way_the_last_cell_too(world):
    brush = PaintTool()
    assert brush.press(world, 0) == {}
    assert brush.move(world, 1) == {0: RIGHT, 1: RIGHT}
    assert brush.move(world, 0) == {1: LEFT}  # in 0 an arrow to the left would leave the grid


def test_a_quick_drag_leaves_no_cell_out(world):
    assert list(steps_between(world.grid, 0, 8)) == [
        (0, RIGHT, 1), (1, UP, 4), (4, RIGHT, 5), (5, UP, 8)]
    assert list(steps_between(world.grid, 2, 0)) == [(2, LEFT, 1), (1, LEFT, 0)]


def test_obstacles_goals_and_arrows_out_of_the_grid_are_left_out(world):
    brush = PaintTool()
    brush.tool = DOWN
    assert brush.press(world, 4) == {}  # the obstacle
    assert brush.press(world, 0) == {}  # nothing is below
    assert brush.press(world, 5) == {5: DOWN}
    assert brush.move(world, 8) == {}  # the goal


def test_the_eraser_erases_every_cell_on_the_way(world):
    brush = PaintTool()
    brush.tool = NO_ACTION
    assert brush.press(world, 0) == {0: NO_ACTION}
    assert brush.move(world, 2) == {1: NO_ACTION, 2: NO_ACTION}


def test_a_click_turns_the_arrow_to_the_next_one_that_the_cell_has(world):
    brush, policy = PaintTool(), np.full(9, NO_ACTION)
    seen = []
    for _ in range(4):
        brush.press(world, 0)
        policy[0] = brush.lift(world, policy)[0]
        seen.append(policy[0])
    assert seen == [UP, RIGHT, NO_ACTION, UP]


def test_the_end_of_a_drag_is_no_click_and_outside_nothing_is_painted(world):
    brush, policy = PaintTool(), np.full(9, NO_ACTION)
    brush.press(world, 0)
    brush.move(world, 1)
    assert brush.lift(world, policy) == {} and not brush.paints
    assert brush.move(world, 2) == {}
    brush.press(world, None)
    assert brush.move(world, 2) == {} and brush.lift(world, policy) == {}
