# SPDX-License-Identifier: Apache-2.0
"""Worlds as metres, angles and percentages, by hand."""

from math import pi, sqrt

import numpy as np
import pytest
from tiny_tables import machine
from tiny_worlds import grid

from comply_ros.plots.viewer_geometry import (
    arrow_and_name_states,
    ARROW_LINES,
    arrow_points,
    ARROW_TRIANGLES,
    heading,
    occupancy,
    places_of,
    trust_percent,
    value_percent,
)
from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import ACTION_NAMES
from comply_ros.world.mdp import World
from comply_ros.world.state_action_spaces import Spaces

WALL = World(grid('.#G', '...'))  # 3 x 2: states 0 1 2 below, 3 4 5 above
PLACES = places_of(WALL, 1.0)


def placed(*positions):
    """Return the machine of three states, the last one terminal, with these positions."""
    return World(machine(positions=np.array(positions, dtype=float)))


def test_the_origin_is_the_lower_left_corner_and_states_are_in_the_centers_of_cells():
    places = places_of(WALL, 0.5)
    assert places.centers([0, 4]).tolist() == [[0.25, 0.25], [0.75, 0.75]]
    assert (places.columns, places.rows, places.is_map) == (3, 2, True)


def test_states_with_positions_are_there_whatever_the_side_of_a_cell():
    places = places_of(placed((2.0, 7.0), (2.5, 7.0), (2.0, 7.5)), 9.0)
    assert places.centers([2, 1]).tolist() == [[2.0, 7.5], [2.5, 7.0]]
    assert (places.columns, places.rows, places.side, places.is_map) == (2, 2, 0.5, True)
    assert places.corner == (1.75, 6.75)
    assert places.cells.tolist() == [0, 1, 2]


def test_positions_that_are_no_cells_are_scattered():
    places = places_of(placed((0.0, 0.0), (1.0, 0.0), (2.5, 3.0)), 9.0)
    assert places.are_scattered and not places.is_map
    assert places.centers([2]).tolist() == [[2.5, 3.0]]
    assert places.side == pytest.approx(sqrt(2.5 * 3.0 / 3))  # a third of the area for each
    line = places_of(placed((0.0, 0.0), (1.0, 0.0), (2.5, 0.0)), 9.0)
    assert line.are_scattered and line.side == pytest.approx(2.5 / 3)


@pytest.mark.parametrize('world', [
    World(machine()), placed((1.0, 1.0), (1.0, 1.0), (2.0, 1.0)), World(Spaces(3, ('go',), 5))])
def test_states_without_a_place_of_their_own_are_read_by_lines(world):
    places = places_of(world, 0.5)
    assert places.are_a_table and not places.is_map
    assert places.centers([0, 1, 2]).tolist() == [[0.25, 0.75], [0.75, 0.75], [0.25, 0.25]]


def test_an_arrow_points_in_the_direction_of_its_action():
    center = np.array([[0.5, 0.5]])
    tips = [arrow_points(center, [name], ARROW_LINES, 1.0)[1].tolist()
            for name in (*ACTION_NAMES, 'up_left')]
    off = 0.42 / sqrt(2)
    assert tips == [pytest.approx(each) for each in (
        (0.08, 0.5), (0.92, 0.5), (0.5, 0.08), (0.5, 0.92), (0.5 - off, 0.5 + off))]


def test_arrows_stay_in_their_cells():
    for shape in (ARROW_TRIANGLES, ARROW_LINES):
        corners = arrow_points(np.full((4, 2), 3.0), ACTION_NAMES, shape, 2.0)
        assert corners.shape == (24, 2)
        assert (corners > 2.0).all() and (corners < 4.0).all()


def test_actions_that_are_no_directions_have_no_arrow():
    world = World(Spaces(4, ('right', 'wait'), 5))
    turned, named = arrow_and_name_states(world, np.array([0, 1, -1, 0]))
    assert (turned.tolist(), named.tolist()) == ([0, 3], [1])


def test_the_map_has_obstacles_and_nothing_else():
    assert occupancy(WALL, PLACES) == [0, 0, 0, 0, 100, 0]


def test_a_map_of_a_table_is_occupied_where_nobody_can_be_and_unknown_between_its_states():
    cliff = World(read_map('cliff_walking', 'published'))
    lowest = occupancy(cliff, places_of(cliff, 1.0))[:12]
    assert lowest == [0, *[100] * 10, 0]  # start, cliff, goal
    corner = placed((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    assert occupancy(corner, places_of(corner, 1.0)) == [0, 0, 0, -1]
    assert trust_percent(corner, places_of(corner, 1.0), [0.5, 1.0, 0.0]) == [50, 100, -1, -1]


def test_trust_is_in_percent_and_unknown_where_the_learner_never_acts():
    assert trust_percent(WALL, PLACES, [0.0, 0.254, 0.256, 1.0, 0.5, 0.5]) == [
        0, 25, 26, 100, -1, -1]


def test_values_are_scaled_from_the_lowest_to_the_highest_of_free_states():
    values = [-2.0, 0.0, 2.0, -1.0, 99.0, 0.0]
    assert value_percent(WALL, values).tolist() == [0, 50, 100, 25]
    assert value_percent(WALL, np.zeros(6)).tolist() == [50] * 4
    largest = [-1.6e308, 0.0, 1.6e308, -0.8e308, 0.0, 0.0]
    assert value_percent(WALL, largest).tolist() == [0, 50, 100, 25]


@pytest.mark.parametrize('there, angle', [
    ((0.5, 1.5), pi), ((2.5, 1.5), 0.0), ((1.5, 0.5), -pi / 2), ((1.5, 2.5), pi / 2),
    ((1.5, 1.5), None)])
def test_a_heading_is_measured_from_x_to_y(there, angle):
    assert heading((1.5, 1.5), there) == angle
