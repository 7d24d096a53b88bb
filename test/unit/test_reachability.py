# SPDX-License-Identifier: Apache-2.0
"""The cells from which a goal can be reached, against a walk from the goals cell by cell."""

import numpy as np
import pytest

from comply_ros.world.reachability import can_reach_goal, connected_components


def walk(free, goal):
    """Return the cells that a walk from the goals over free cells reaches, and the goals."""
    found, border = goal.copy(), list(zip(*goal.nonzero()))
    while border:
        y, x = border.pop()
        for y2, x2 in ((y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)):
            inside = 0 <= y2 < free.shape[0] and 0 <= x2 < free.shape[1]
            if inside and free[y2, x2] and not found[y2, x2]:
                found[y2, x2] = True
                border.append((y2, x2))
    return found


def cells_of(*rows):
    """Return where cells are free and where goals are, of rows of text."""
    cells = np.array([list(row) for row in rows])
    return cells == '.', cells == 'G'


@pytest.mark.parametrize('seed', range(60))
def test_random_maps_have_the_cells_of_a_walk(seed):
    generator = np.random.Generator(np.random.PCG64(seed))
    cells = generator.choice(list('...##G'), p=[0.2, 0.2, 0.2, 0.19, 0.19, 0.02],
                             size=generator.integers(1, 40, size=2))
    assert (can_reach_goal(cells == '.', cells == 'G') == walk(cells == '.', cells == 'G')).all()


def test_a_way_may_turn_in_every_row():
    lines = ['.' * 41 if y % 2 == 0 else '#' * 40 + '.' if y % 4 == 1 else '.' + '#' * 40
             for y in range(41)]
    free, goal = cells_of('G' + '.' * 40, *lines[1:])
    assert can_reach_goal(free, goal)[free].all()
    free[20, 20] = False
    assert (can_reach_goal(free, goal) == walk(free, goal)).all()
    assert not can_reach_goal(free, goal)[free].all()


def test_no_way_leads_through_a_goal_or_an_obstacle_or_around_the_edge():
    free, goal = cells_of('..#G.', '###.#', '.....')
    assert can_reach_goal(free, goal).astype(int).tolist() == [
        [0, 0, 0, 1, 1], [0, 0, 0, 1, 0], [1, 1, 1, 1, 1]]
    free, goal = cells_of('#G#', '###', '..#')
    assert can_reach_goal(free, goal).astype(int).tolist() == [[0, 1, 0], [0, 0, 0], [0, 0, 0]]


def test_a_map_of_goals_alone_is_reachable():
    assert can_reach_goal(*cells_of('GG')).tolist() == [[True, True]]


def test_roots_are_equal_where_pairs_connect():
    one, other = np.array([5, 4, 3, 7, 1]), np.array([4, 3, 5, 8, 1])
    assert connected_components(9, one, other).tolist() == [0, 1, 2, 3, 3, 3, 6, 7, 7]
