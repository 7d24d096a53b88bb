# SPDX-License-Identifier: Apache-2.0
"""Where the states of a world that is no grid are drawn, and the signs of its actions."""

import numpy as np
import pytest
from tiny_tables import machine
from tiny_worlds import grid

from comply_ros.plots.state_layout import goals_of, layout_of, short_name, sign
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World
from comply_ros.world.state_action_spaces import Spaces


def placed(*positions):
    """Return the machine of three states with these positions."""
    return World(machine(positions=np.array(positions, dtype=float)))


def test_cells_of_a_map_are_where_they_are_in_the_world():
    layout = layout_of(World(read_map('frozen_lake', 'published')))
    assert (layout.columns, layout.rows, layout.side, layout.is_map) == (4, 4, 1.0, True)
    assert layout.places[[0, 3, 15]].tolist() == [[0, 3], [3, 3], [3, 0]]


def test_the_side_of_a_cell_is_the_smallest_step_between_two_places():
    layout = layout_of(placed((2.0, 7.0), (2.5, 7.0), (2.0, 8.0)))
    assert (layout.columns, layout.rows, layout.side, layout.is_map) == (2, 3, 0.5, True)
    assert layout.places.tolist() == [[0, 2], [1, 2], [0, 0]]


@pytest.mark.parametrize('world, columns', [
    (World(read_map('taxi', 'published')), 23), (World(machine()), 2),
    (World(Spaces(10, ('go', 'wait'), 5)), 4),
    (placed((0, 0), (0, 0), (1, 0)), 2), (placed((0, 0), (1, 0), (2.5, 0)), 2)])
def test_states_without_a_cell_of_their_own_are_in_their_order(world, columns):
    layout = layout_of(world)
    assert (layout.columns, layout.is_map) == (columns, False)
    assert layout.places[0].tolist() == [0, 0] and layout.places[1].tolist() == [1, 0]
    assert layout.places[columns].tolist() == [0, 1]
    assert len(np.unique(layout.places, axis=0)) == world.n_states


def test_the_goals_are_what_earns_most_and_every_goal_of_a_grid():
    assert np.flatnonzero(goals_of(World(read_map('frozen_lake', 'published')))).tolist() == [3]
    assert np.flatnonzero(goals_of(World(grid('.GG')))).tolist() == [1, 2]
    assert not goals_of(World(Spaces(2, ('go',), 5))).any()


@pytest.mark.parametrize('name, shown', [
    ('up_left', '\u2196'), ('stay', '\u2022'), ('pick_up', 'pu'), ('12', '12'), ('+1-1', '+1-1'),
    ('forth', 'for'), ('left turn', 'lt')])
def test_an_action_has_a_sign_of_a_few_characters(name, shown):
    assert sign(name) == shown


def test_a_short_name_has_no_arrows():
    assert [short_name(name) for name in ('up_left', 'stay', 'pick_up')] == ['ul', 'stay', 'pu']
