# SPDX-License-Identifier: Apache-2.0
"""What the viewer shows as markers, in worlds of every form."""

from dataclasses import replace

import numpy as np
import pytest
from std_msgs.msg import Header
from tiny_tables import machine
from tiny_worlds import grid
from visualization_msgs.msg import Marker

from comply_ros.nodes import viewer_markers
from comply_ros.nodes.viewer_markers import (
    GREY,
    INK,
    largest_trust,
    mentor_message,
    mentors_message,
    places_message,
    policy_message,
    TRUST_COLORS,
    values_message,
)
from comply_ros.plots.mentor_marks import mentor_color
from comply_ros.plots.viewer_geometry import places_of
from comply_ros.protocol.state_maps import MentorReports
from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import NO_ACTION, RIGHT
from comply_ros.world.mdp import World

RUN, STOP, REPAIR = range(3)
MACHINE = World(machine())


def shown(message):
    """Return the markers of a message by namespace; the first one removes what was there."""
    removal, *markers = message.markers
    assert removal.action == Marker.DELETEALL
    found = {}
    for marker in markers:
        if marker.action == Marker.ADD:
            found.setdefault(marker.ns, []).append(marker)
    return found


def colors(trust, learned):
    """Return the color of each arrow, left to right."""
    world, policy = World(grid('...G')), np.array([RIGHT, RIGHT, RIGHT, NO_ACTION])
    message = mentor_message(Header(), world, places_of(world, 1.0), policy, trust, learned)
    (marker,), = shown(message).values()
    if not marker.colors:
        return [marker.color] * 3
    each = len(marker.points) // 3
    assert len(marker.colors) == len(marker.points)
    return [marker.colors[k] for k in range(0, 3 * each, each)]


def test_arrows_are_grey_where_the_learner_was_never():
    trust, learned = np.ones(4), np.array([NO_ACTION, RIGHT, NO_ACTION, NO_ACTION])
    assert colors(trust, learned) == [GREY, TRUST_COLORS[100], GREY]
    assert colors(trust, None) == [GREY] * 3 and colors(None, learned) == [GREY] * 3


def mentor(world, policy, trust, learned):
    """Return the markers of a mentor."""
    arrays = (None if each is None else np.array(each) for each in (policy, trust, learned))
    return shown(mentor_message(Header(), world, places_of(world, 1.0), *arrays))


def test_a_world_without_a_map_has_a_tile_for_each_state_in_the_color_of_its_trust():
    tiles, = mentor(MACHINE, None, (0.0, 1.0, 0.0), (RUN, STOP, NO_ACTION))['trust']
    assert tiles.type == Marker.CUBE_LIST  # of on and worn: off is terminal
    assert [(p.x, p.y) for p in tiles.points] == [(0.5, 1.5), (1.5, 1.5)]
    assert list(tiles.colors) == [TRUST_COLORS[0], TRUST_COLORS[100]]
    grey, = mentor(MACHINE, None, None, None)['trust']
    assert grey.color == GREY and len(grey.points) == 2


def test_an_action_that_is_no_direction_is_written_above_the_middle_of_its_cell():
    markers = mentor(MACHINE, (REPAIR, NO_ACTION, NO_ACTION), None, None)
    text, = markers['mentor names']
    assert set(markers) == {'mentor names', 'trust'}
    assert (text.type, text.text, text.id, text.color) == (
        Marker.TEXT_VIEW_FACING, 'rep', 0, INK)
    place = text.pose.position
    assert (place.x, place.y) == (0.5, 1.7) and place.z > markers['trust'][0].points[0].z


def test_the_learners_names_are_below_those_of_the_mentor():
    message = policy_message(Header(), MACHINE, places_of(MACHINE, 1.0), np.array([RUN, -1, -1]))
    text, = shown(message)['policy names']
    assert (text.text, text.pose.position.y) == ('run', 1.3)


def test_names_on_a_map_have_the_color_of_the_trust():
    world = World(machine(positions=np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]])))
    markers = mentor(world, (RUN, REPAIR, NO_ACTION), (0.0, 1.0, 0.0), (RUN, RUN, NO_ACTION))
    assert set(markers) == {'mentor names'}
    assert [text.color for text in markers['mentor names']] == [
        TRUST_COLORS[0], TRUST_COLORS[100]]


def test_scattered_states_are_spheres_at_their_places():
    world = World(machine(positions=np.array([[0.0, 0.0], [1.0, 0.0], [2.5, 3.0]])))
    spheres, = mentor(world, None, None, None)['trust']
    assert spheres.type == Marker.SPHERE_LIST
    assert [(p.x, p.y) for p in spheres.points] == [(0.0, 0.0), (1.0, 0.0)]


def test_more_names_than_anybody_reads_are_left_out(monkeypatch):
    monkeypatch.setattr(viewer_markers, 'MAX_NAMES', 1)
    assert 'mentor names' in mentor(MACHINE, (RUN, NO_ACTION, NO_ACTION), None, None)
    assert set(mentor(MACHINE, (RUN, RUN, NO_ACTION), None, None)) == {'trust'}


@pytest.mark.parametrize('name, directions', [
    ('frozen_lake', True), ('stochastic_windy', True), ('taxi', False), ('racetrack', False)])
def test_every_advised_state_of_a_shipped_world_has_an_arrow_or_a_name(name, directions):
    world = World(read_map(name, 'published'))
    policy = np.where(world.free, world.available.argmax(axis=1), NO_ACTION)
    markers = mentor(world, policy, None, None)
    arrows = sum(len(marker.points) // 6 for marker in markers.get('mentor', ()))
    names = len(markers.get('mentor names', ()))
    assert arrows + names == world.free.sum()
    assert (names == 0, 'trust' not in markers) == (directions or name == 'taxi', directions)


def test_ends_that_earn_less_are_pits():
    world = World(read_map('frozen_lake', 'published'))
    markers = shown(places_message(Header(), world, places_of(world, 1.0)))
    assert {name: len(each.points) for name, (each,) in markers.items()} == {
        'goals': 1, 'pits': 4, 'starts': 1}
    goal, = markers['goals'][0].points
    assert (goal.x, goal.y) == (3.5, 0.5)


def test_values_are_in_every_free_state_and_their_scale_is_below():
    world = World(replace(machine(), positions=np.array([[5.0, 5.0], [6.0, 5.0], [5.0, 6.0]])))
    message = values_message(Header(), world, places_of(world, 1.0), np.array([1.0, 3.0, 0.0]))
    tiles, caption = message.markers
    assert [(p.x, p.y) for p in tiles.points] == [(5.0, 5.0), (6.0, 5.0)]
    assert caption.text == 'values: white 1, blue 3'
    assert caption.pose.position.x == 5.5 and caption.pose.position.y < 4.5


def of_mentors(world, mentors, learned):
    """Return the markers of several mentors."""
    return shown(mentors_message(Header(), world, places_of(world, 1.0), mentors,
                                 np.array(learned)))


ANNA = MentorReports(np.array([1.0, 0.5, 0.0]), np.array([RIGHT, RIGHT, NO_ACTION]), 0.75)
BOB = MentorReports(np.array([0.25, 0.75, 0.0]), np.array([RIGHT, NO_ACTION, NO_ACTION]))


def test_each_mentor_has_arrows_of_its_own_color_in_a_part_of_the_cell_of_its_own():
    found = of_mentors(World(grid('..G')), {'anna': ANNA, 'bob': BOB}, (RIGHT, NO_ACTION, RIGHT))
    (anna,), (bob,) = found['mentor anna'], found['mentor bob']
    assert (len(anna.points), len(bob.points)) == (12, 6)
    assert max(point.x for point in anna.points[:6]) <= 0.5 <= min(point.x for point in bob.points)
    own = [round(255 * each) for each in (anna.colors[0].r, anna.colors[0].g, anna.colors[0].b)]
    assert '#' + bytes(own).hex() == mentor_color(0).lower()
    assert (anna.colors[0].a, anna.colors[6]) == (1.0, GREY)  # trusted, and never visited
    assert bob.colors[0].a == 0.4375


def test_the_legend_has_each_name_and_the_confidence_in_it():
    lines = of_mentors(World(grid('..G')), {'anna': ANNA, '': BOB}, 3 * [RIGHT])['mentors']
    assert [line.text for line in lines] == ['anna 0.75', 'without a name -']
    assert len({(line.pose.position.x, line.pose.position.y) for line in lines}) == 2
    assert min(line.pose.position.y for line in lines) > 1.0  # above the map


def test_tiles_have_the_largest_trust_in_any_mentor():
    assert largest_trust({'anna': ANNA, 'bob': BOB}).tolist() == [1.0, 0.75, 0.0]
    assert largest_trust({'anna': MentorReports()}) is None
    tiles, = of_mentors(MACHINE, {'anna': ANNA, 'bob': BOB}, (RUN, STOP, NO_ACTION))['trust']
    assert list(tiles.colors) == [TRUST_COLORS[100], TRUST_COLORS[75]]
