# SPDX-License-Identifier: Apache-2.0
"""The picture of a grid as SVG."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from tiny_worlds import grid

from comply_ros.dashboard import grid_svg
from comply_ros.plots.mentor_marks import mentor_color
from comply_ros.protocol.state_maps import MentorReports
from comply_ros.world.grid import NO_ACTION, RIGHT, UP
from comply_ros.world.mdp import World


@pytest.fixture
def world():
    return World(grid('..G', '.#.', '...'))


def shapes(svg):
    """Return the elements of a layer."""
    return list(ElementTree.fromstring(f'<svg>{svg}</svg>').iter())[1:]


def test_a_point_is_in_the_cell_that_is_drawn_there(world):
    for s in range(9):
        assert grid_svg.state_at(world.grid, *grid_svg.middle(world.grid, s)) == s
    assert grid_svg.state_at(world.grid, 119.9, 0.0) == 8
    assert grid_svg.state_at(world.grid, 120.0, 0.0) is None
    assert grid_svg.state_at(world.grid, -1.0, 5.0) is None


def test_obstacles_side_by_side_are_one_shape():
    assert list(grid_svg.spans('##.#', '#')) == [(0, 2), (3, 1)]
    assert list(grid_svg.spans('...', '#')) == []


def test_every_arrow_is_drawn_in_the_colour_of_its_trust(world):
    policy, trust = np.full(9, NO_ACTION, dtype=np.int8), np.zeros(9, dtype=np.float32)
    policy[[0, 1, 4]], trust[1] = RIGHT, 1.0  # 4 is an obstacle
    learned = np.full(9, UP, dtype=np.int8)
    paths = {path.get('fill'): path.get('d') for path in shapes(
        grid_svg.mentor_arrows(world, policy, trust, learned))}
    assert paths == {'#cc3311': 'M20 100' + grid_svg.WIDE[RIGHT],
                     '#009e73': 'M60 100' + grid_svg.WIDE[RIGHT]}


def test_arrows_are_grey_before_any_trust_is_known(world):
    path, = shapes(grid_svg.mentor_arrows(world, np.full(9, UP, dtype=np.int8), None, None))
    assert path.get('class') == 'unknown' and path.get('d').count('M') == 7


def test_arrows_are_grey_where_the_learner_was_never(world):
    policy, trust = np.full(9, UP, dtype=np.int8), np.ones(9, dtype=np.float32)
    learned = np.full(9, NO_ACTION, dtype=np.int8)
    learned[1] = RIGHT
    grey, green = shapes(grid_svg.mentor_arrows(world, policy, trust, learned))
    assert grey.get('class') == 'unknown' and grey.get('d').count('M') == 6
    assert green.get('fill') == '#009e73' and green.get('d').startswith('M60 100')
    grey, = shapes(grid_svg.mentor_arrows(world, policy, trust, None))
    assert grey.get('d').count('M') == 7


def test_all_layers_are_well_formed(world):
    policy = np.where(world.free, RIGHT, NO_ACTION)
    for svg in (grid_svg.cells(world), grid_svg.learner_arrows(world, policy),
                grid_svg.robot(world.grid, 3, waits=True)):
        assert shapes(svg)


def test_the_robot_stands_in_its_cell(world):
    svg = grid_svg.robot(world.grid, 5)
    assert re.search('cx="100" cy="60"', svg) and 'waits' not in svg


def test_no_arrows_are_drawn_in_a_map_where_nobody_could_see_them(monkeypatch, world):
    monkeypatch.setattr(grid_svg, 'MAX_CELLS', 8)
    policy = np.full(9, UP, dtype=np.int8)
    assert grid_svg.mentor_arrows(world, policy, None, None) == ''
    assert grid_svg.learner_arrows(world, policy) == ''


def test_each_mentor_has_arrows_of_its_color_that_are_fainter_where_it_is_trusted_less(world):
    policy, learned = np.full(9, NO_ACTION, dtype=np.int8), np.full(9, NO_ACTION)
    policy[:2], learned[0] = RIGHT, RIGHT
    trust = np.array([0.5, 0.5, 0, 0, 0, 0, 0, 0, 0], dtype=np.float32)
    mentors = {0: MentorReports(trust, policy), 3: MentorReports(1.0 - trust, policy),
               5: MentorReports(trust)}  # which has published no policy
    anna, never, faint, bob, *_ = shapes(grid_svg.arrows_of_mentors(world, mentors, learned))
    assert [anna.get('color'), bob.get('color')] == [mentor_color(0), mentor_color(3)]
    assert anna.get('transform') == 'translate(-10 -10) scale(0.5)'
    assert bob.get('transform') == 'translate(10 -10) scale(0.5)'
    assert never.get('class') == 'never-visited'
    assert never.get('d') == f'M120 200{grid_svg.WIDE[RIGHT]}'  # its cell is at (60, 100)
    assert (faint.get('opacity'), faint.get('d')) == ('0.62', f'M40 200{grid_svg.WIDE[RIGHT]}')


def test_without_any_policy_there_is_nothing_of_mentors(world):
    assert grid_svg.arrows_of_mentors(world, {0: MentorReports(), 1: MentorReports()}, None) == ''
