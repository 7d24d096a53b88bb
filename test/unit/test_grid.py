# SPDX-License-Identifier: Apache-2.0
"""A correct map is accepted; every rule has a tiny map that breaks it."""

from dataclasses import replace
import hashlib
from struct import pack

import pytest
from tiny_worlds import grid

from comply_ros.world.grid import LARGEST_SIDE, MapError


def test_states_count_from_the_lower_left():
    small = grid('#G.', '..#')
    assert (small.width, small.height) == (3, 2)
    assert small.cells == '..##G.'
    assert small.place(4) == (1, 1)


def test_equal_hashes_mean_equal_worlds():
    small = grid('..G')
    assert small.sha256 == grid('..G').sha256
    assert len(small.sha256) == 64
    assert small.sha256 != replace(small, step_reward=-1.5).sha256
    assert small.sha256 != replace(small, starts=(1,)).sha256


def test_the_hash_is_that_of_the_bytes_that_the_documentation_names():
    small = grid('#G.', '..#', starts=(0, 5), step=-0.5, obstacle=-2, goal=-0.0, intended=0.75)
    content = (b'comply_ros grid 1\n' + pack('<4q', 3, 2, 2, 50)
               + pack('<4d', -0.5, -2.0, 0.0, 0.75) + b'\1' + b'..##G.' + pack('<2q', 0, 5))
    assert small.sha256 == hashlib.sha256(content).hexdigest()
    assert replace(small, goal_reward=0.0).sha256 == small.sha256
    assert replace(small, slips_bump=False).sha256 != small.sha256


@pytest.mark.parametrize('rows, settings, message', [
    ((), {}, 'a map needs at least one row of cells, got none'),
    (('..G', '..'), {}, 'all rows must have the same length: row 2 has 2 cells, row 1 has 3'),
    (('..x', '..G'), {}, "a cell must be one of . # G, got 'x' in row 1, column 3"),
    (('...',), {}, 'a map needs at least one goal G, got none'),
    (('..G',), {'starts': ()}, 'a map needs at least one start, got none'),
    (('#.G',), {}, 'a start must be a free cell, but (0, 0) is an obstacle'),
    (('..G',), {'starts': (2,)}, 'a start must be a free cell, but (2, 0) is the goal'),
    (('..G',), {'starts': (3,)}, 'a start must lie in the grid of 3 cells, got state 3'),
    (('.#G',), {},
     'the goal must be reachable from every start, but no way leads there from (0, 0)'),
    (('..G',), {'step': 0.0},
     'step_reward must be below 0, or the best policy never arrives, got 0.0'),
    (('..G',), {'obstacle': 1.0},
     'obstacle_reward must be below 0, or the best policy never arrives, got 1.0'),
    (('..G',), {'goal': float('nan')},
     'goal_reward must be a finite number of at most 1000000, got nan'),
    (('..G',), {'step': -1e308},
     'step_reward must be a finite number of at most 1000000, got -1e+308'),
    (('..G',), {'intended': 1.3}, 'intended must lie in (0, 1], got 1.3'),
    (('..G',), {'limit': 0}, 'step_limit must lie in [1, 1000000], got 0'),
    (('.' * LARGEST_SIDE + 'G',), {},
     f'a map may have at most {LARGEST_SIDE} cells a side, got {LARGEST_SIDE + 1} x 1'),
])
def test_a_wrong_map_is_rejected_with_the_rule_that_it_breaks(rows, settings, message):
    with pytest.raises(MapError) as error:
        grid(*rows, **settings)
    assert str(error.value) == message


def test_no_way_leads_through_an_obstacle_or_a_goal():
    with pytest.raises(MapError, match='no way leads there'):
        grid('.#G', starts=(0,))
    assert grid('..G.G').starts == (0,)


def test_of_many_wrong_starts_the_first_is_named():
    rows = ('....#.', '..G.#.', '....#.')  # the last column is cut off, the one before is walls
    for starts, message in (((0, 5, 11), r'no way leads there from \(5, 0\)'),
                            ((0, 4, 17, 99), r'\(4, 0\) is an obstacle'),
                            ((0, 8, 4), r'\(2, 1\) is the goal'),
                            ((0, 99, 4), 'got state 99'), ((0, 4, -1), r'\(4, 0\) is an obs'),
                            ((0, -1, 99), 'got state -1')):
        with pytest.raises(MapError, match=message):
            grid(*rows, starts=starts)
    assert grid(*rows, starts=(3, 0, 3)).starts == (3, 0, 3)
