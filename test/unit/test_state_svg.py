# SPDX-License-Identifier: Apache-2.0
"""The picture of a world that is no grid as SVG."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from tiny_tables import machine

from comply_ros.dashboard import state_svg
from comply_ros.dashboard.grid_svg import THIN, WIDE
from comply_ros.plots.mentor_marks import mentor_color
from comply_ros.plots.state_layout import layout_of
from comply_ros.protocol.state_maps import MentorReports
from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import DOWN, NO_ACTION, RIGHT
from comply_ros.world.mdp import World
from comply_ros.world.state_action_spaces import Spaces


@pytest.fixture(scope='module')
def lake():
    return World(read_map('frozen_lake', 'published'))


def shapes(svg):
    """Return the elements of a layer."""
    return list(ElementTree.fromstring(f'<svg>{svg}</svg>').iter())[1:]


def only(world, s, action):
    """Return a policy that has an action in one state."""
    policy = np.full(world.n_states, NO_ACTION, dtype=np.int8)
    policy[s] = action
    return policy


def test_state_0_is_at_the_lower_left_of_the_picture(lake):
    layout = layout_of(lake)
    assert state_svg.middle(layout, 0) == (20, 140)
    assert state_svg.middle(layout, 15) == (140, 20)
    assert state_svg.size(layout) == (160, 160)


def test_a_hole_is_a_pit_and_what_earns_most_a_goal(lake):
    svg = state_svg.cells(lake, layout_of(lake))
    assert (svg.count('class="goal"'), svg.count('class="pit"')) == (1, 4)
    assert svg.count('class="start"') == 1 and shapes(svg)


def test_an_action_that_is_a_direction_is_an_arrow_in_the_colour_of_its_trust(lake):
    layout, trust = layout_of(lake), np.ones(16, dtype=np.float32)
    policy = only(lake, 12, RIGHT)
    grey, = shapes(state_svg.mentor_arrows(lake, layout, policy, trust, None))
    assert grey.get('class') == 'unknown' and grey.get('d') == f'M20 20{WIDE[RIGHT]}'
    green, = shapes(state_svg.mentor_arrows(lake, layout, policy, trust, policy))
    assert green.get('fill') == '#009e73'
    thin, = shapes(state_svg.learner_arrows(lake, layout, only(lake, 1, DOWN)))
    assert thin.get('d') == f'M60 140{THIN[DOWN]}'


def test_another_action_is_a_sign():
    world = World(machine())
    text, = shapes(state_svg.mentor_arrows(
        world, layout_of(world), only(world, 0, 2), None, None))
    assert text.tag == 'text' and text.text == 'rep'


def test_each_of_several_mentors_has_its_part_of_a_cell():
    world, learned = World(machine()), np.array([0, 0, NO_ACTION])
    trust = np.array([1.0, 0.0, 0.0])
    mentors = {m: MentorReports(trust, only(world, m, 2)) for m in (0, 1)}
    anna, first, bob, second = shapes(state_svg.arrows_of_mentors(
        world, layout_of(world), mentors, learned))
    assert [anna.get('color'), bob.get('color')] == [mentor_color(0), mentor_color(1)]
    assert (anna.get('transform'), bob.get('transform')) == (
        'translate(-10 0) scale(0.5)', 'translate(10 0) scale(0.5)')
    assert [(each.text, each.get('opacity')) for each in (first, second)] == [
        ('rep', '1.00'), ('rep', '0.25')]
    unseen, = shapes(state_svg.arrows_of_mentors(
        world, layout_of(world), {0: mentors[0], 1: MentorReports()}, None))[1:]
    assert unseen.get('class') == 'never-visited'


def test_a_diagonal_direction_is_a_turned_arrow():
    world = World(read_map('stochastic_windy', 'published'))
    layout, s = layout_of(world), int(world.starts[0])
    x, y = state_svg.middle(layout, s)
    path, = shapes(state_svg.mentor_arrows(
        world, layout, only(world, s, world.action_names.index('up_right')), None, None))
    assert path.get('transform') == f'rotate(-45 {x} {y})'
    assert path.get('d') == f'M{x} {y}{WIDE[RIGHT]}'


def test_a_sign_of_a_user_is_no_markup():
    world = World(Spaces(2, ('<b>', 'b'), 5))
    text, = shapes(state_svg.learner_arrows(
        world, layout_of(world), only(world, 1, 0)))
    assert text.text == '<b>'


def test_the_robot_stands_in_its_cell(lake):
    assert re.search('cx="100" cy="140"', state_svg.robot(layout_of(lake), 2))


def test_no_actions_are_drawn_where_nobody_could_see_them(monkeypatch, lake):
    monkeypatch.setattr(state_svg, 'MAX_CELLS', 15)
    layout = layout_of(lake)
    assert state_svg.mentor_arrows(lake, layout, only(lake, 0, 1), None, None) == ''
    assert state_svg.learner_arrows(lake, layout, only(lake, 0, 1)) == ''
