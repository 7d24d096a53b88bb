# SPDX-License-Identifier: Apache-2.0
"""Cells as metres, angles and percentages, by hand."""

from math import pi

import numpy as np
import pytest
from tiny_worlds import grid

from comply_ros.plots.viewer_geometry import (
    ARROW_LINES,
    arrow_points,
    ARROW_TRIANGLES,
    cell_centers,
    heading,
    occupancy,
    trust_percent,
    value_percent,
)
from comply_ros.world.mdp import World

WALL = World(grid('.#G', '...'))  # 3 x 2: states 0 1 2 below, 3 4 5 above


def test_the_origin_is_the_lower_left_corner_and_states_are_in_the_centers_of_cells():
    assert cell_centers([0, 4], 3, 0.5).tolist() == [[0.25, 0.25], [0.75, 0.75]]


def test_an_arrow_points_in_the_direction_of_its_action():
    tips = [arrow_points([0], [action], ARROW_LINES, 3, 1.0)[1].tolist() for action in range(4)]
    assert tips == [pytest.approx(each) for each in (
        (0.08, 0.5), (0.92, 0.5), (0.5, 0.08), (0.5, 0.92))]


def test_arrows_stay_in_their_cells():
    for shape in (ARROW_TRIANGLES, ARROW_LINES):
        corners = arrow_points([4] * 4, range(4), shape, 3, 2.0)
        assert corners.shape == (24, 2)
        assert (corners > 2.0).all() and (corners < 4.0).all()


def test_the_map_has_obstacles_and_nothing_else():
    assert occupancy(WALL) == [0, 0, 0, 0, 100, 0]


def test_trust_is_in_percent_and_unknown_where_the_learner_never_acts():
    assert trust_percent(WALL, [0.0, 0.254, 0.256, 1.0, 0.5, 0.5]) == [
        0, 25, 26, 100, -1, -1]


def test_values_are_scaled_from_the_lowest_to_the_highest_of_free_states():
    values = [-2.0, 0.0, 2.0, -1.0, 99.0, 0.0]
    assert value_percent(WALL, values).tolist() == [0, 50, 100, 25]
    assert value_percent(WALL, np.zeros(6)).tolist() == [50] * 4


@pytest.mark.parametrize('s2, angle', [(3, pi), (5, 0.0), (1, -pi / 2), (7, pi / 2), (4, None)])
def test_a_heading_is_measured_from_x_to_y(s2, angle):
    assert heading(4, s2, 3) == angle
