# SPDX-License-Identifier: Apache-2.0
"""The arrows that strokes over cells paint."""

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
    tool = PaintTool()
    assert tool.press(world, 0) == {}
    assert tool.move(world, 1) == {0: RIGHT, 1: RIGHT}
    assert tool.move(world, 0) == {1: LEFT}  # in 0 an arrow to the left would leave the grid


def test_a_fast_drag_leaves_no_cell_out(world):
    assert list(steps_between(world.grid, 0, 8)) == [
        (0, RIGHT, 1), (1, UP, 4), (4, RIGHT, 5), (5, UP, 8)]
    assert list(steps_between(world.grid, 2, 0)) == [(2, LEFT, 1), (1, LEFT, 0)]


def test_arrows_in_obstacles_in_goals_and_out_of_the_grid_are_not_painted(world):
    tool = PaintTool()
    tool.tool = DOWN
    assert tool.press(world, 4) == {}  # the obstacle
    assert tool.press(world, 0) == {}  # nothing is below
    assert tool.press(world, 5) == {5: DOWN}
    assert tool.move(world, 8) == {}  # the goal


def test_erase_removes_the_arrow_of_every_cell_on_the_way(world):
    tool = PaintTool()
    tool.tool = NO_ACTION
    assert tool.press(world, 0) == {0: NO_ACTION}
    assert tool.move(world, 2) == {1: NO_ACTION, 2: NO_ACTION}


def test_a_click_turns_the_arrow_to_the_next_one_that_the_cell_has(world):
    tool, policy = PaintTool(), np.full(9, NO_ACTION)
    arrows = []
    for _ in range(4):
        tool.press(world, 0)
        policy[0] = tool.release(world, policy)[0]
        arrows.append(policy[0])
    assert arrows == [UP, RIGHT, NO_ACTION, UP]


def test_the_end_of_a_drag_is_no_click_and_nothing_is_painted_outside(world):
    tool, policy = PaintTool(), np.full(9, NO_ACTION)
    tool.press(world, 0)
    tool.move(world, 1)
    assert tool.release(world, policy) == {} and not tool.painting
    assert tool.move(world, 2) == {}
    tool.press(world, None)
    assert tool.move(world, 2) == {} and tool.release(world, policy) == {}


def test_a_finger_paints_when_it_moves_or_leaves_and_not_when_a_second_one_comes(world):
    tool = PaintTool()
    tool.tool = RIGHT
    assert tool.press(world, 0, touch=True) == {}
    tool.cancel()
    assert tool.move(world, 1) == {} and tool.release(world, np.full(9, NO_ACTION)) == {}
    assert tool.press(world, 0, touch=True) == {}
    assert tool.release(world, np.full(9, NO_ACTION)) == {0: RIGHT}
    assert tool.press(world, 0, touch=True) == {}
    assert tool.move(world, 1) == {0: RIGHT, 1: RIGHT}
    assert tool.release(world, np.full(9, NO_ACTION)) == {}
