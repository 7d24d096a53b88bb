# SPDX-License-Identifier: Apache-2.0
"""What the viewer shows as a map, a pose and a path."""

import numpy as np
from std_msgs.msg import Header
from tiny_tables import machine
from tiny_worlds import grid

from comply_ros.nodes.viewer_messages import (
    map_message,
    no_map_message,
    trail_message,
    trust_message,
)
from comply_ros.plots.viewer_geometry import places_of
from comply_ros.world.mdp import World

CORNER = World(machine(positions=np.array([[2.0, 7.0], [2.5, 7.0], [2.0, 7.5]])))


def test_the_map_of_a_table_lies_where_its_states_are():
    shown = map_message(Header(), CORNER, places_of(CORNER, 1.0))
    assert (shown.info.width, shown.info.height, shown.info.resolution) == (2, 2, 0.5)
    origin = shown.info.origin
    assert (origin.position.x, origin.position.y, origin.orientation.w) == (1.75, 6.75, 1.0)
    assert list(shown.data) == [0, 0, 0, -1]


def test_trust_is_unknown_everywhere_before_it_was_received():
    world = World(grid('..G'))
    places = places_of(world, 1.0)
    assert list(trust_message(Header(), world, places, None).data) == [-1, -1, -1]
    assert list(trust_message(Header(), world, places, [0.5, 1.0, 0.0]).data) == [50, 100, -1]


def test_a_map_is_removed_by_one_without_cells():
    assert list(no_map_message(Header()).data) == []


def test_a_trail_goes_through_the_places_of_its_states():
    path = trail_message(Header(), places_of(CORNER, 1.0).centers([0, 2]))
    assert [(p.pose.position.x, p.pose.position.y) for p in path.poses] == [(2.0, 7.0), (2.0, 7.5)]
