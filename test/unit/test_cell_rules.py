# SPDX-License-Identifier: Apache-2.0
"""Every way in which rules of cells can be wrong, each with its tiny map."""

from cell_maps import rules
import pytest

from comply_ros.world.cell_rules import Letter
from comply_ros.world.grid import MapError
from comply_ros.world.wind import Wind

ONE_OF = '. # S < > v ^'


@pytest.mark.parametrize('rows, changes, message', [
    ((), {}, 'a map needs at least one row of cells, got none'),
    (('..G', '..'), {}, 'all rows must have the same length: row 2 has 2 cells, row 1 has 3'),
    (('.QG',), {}, 'a cell must be one of . # G S < > v ^ or a letter of the legend, got '
     "'Q' in row 1, column 2"),
    (('.' * 4096 + 'G',), {}, 'a map may have at most 4096 cells a side, got 4097 x 1'),
    (('..',), {}, 'a map needs at least one goal G, another cell that ends the episode, or '
     'continuing: true, got none'),
    (('.G',), {'step_reward': float('nan')},
     'step_reward must be a finite number of at most 1000000, got nan'),
    (('.G',), {'obstacle_reward': 1e7},
     'obstacle_reward must be a finite number of at most 1000000, got 10000000.0'),
    (('.G',), {'edge_reward': float('inf')},
     'edge_reward must be a finite number of at most 1000000, got inf'),
    (('.G',), {'wall_reward': float('inf')},
     'wall_reward must be a finite number of at most 1000000, got inf'),
    (('.G',), {'legend': {'H': Letter(float('inf'))}},
     "the reward of 'H' must be a finite number of at most 1000000, got inf"),
    (('.G',), {'moves': 6}, 'moves must be 4 or 8, got 6'),
    (('.G',), {'intended': 0.0}, 'intended must lie in (0, 1], got 0.0'),
    (('.G',), {'step_limit': 0}, 'step_limit must lie in [1, 1000000], got 0'),
    (('.G',), {'cell_size': 0.0}, 'cell_size must lie in (0, 1000000] metres, got 0.0'),
    (('.G',), {'slips': 'often'},
     "slips must be other, right_angles or a table of chances, got 'often'"),
    (('.G',), {'slips': {45: 0.1}},
     'a slip must turn by -180, -90, 90, 180 degrees, or stay, got 45'),
    (('.G',), {'slips': {'back': 0.1}},
     "a slip must turn by -180, -90, 90, 180 degrees, or stay, got 'back'"),
    (('.G',), {'slips': {30: 0.1}, 'moves': 8}, 'a slip must turn by -180, -135, -90, -45, 45, '
     '90, 135, 180 degrees, or stay, got 30'),
    (('.G',), {'slips': {180: 0.1, -180: 0.1}},
     'a slip of 180 degrees must be given once, got 180 and -180'),
    (('.G',), {'slips': {90: -0.1}}, 'a chance of slips must lie in [0, 1], got -0.1 for 90'),
    (('.G',), {'slips': {90: 0.75, -90: 0.5}},
     'the chances of slips must not exceed 1 in sum, got 1.25'),
    (('.G',), {'slips': {90: 0.1}, 'intended': 0.9}, 'intended must be left out where slips has '
     'chances: it is what they leave of 1, got 0.9'),
    (('.G',), {'legend': {'HH': Letter()}},
     f"a letter of the legend must be one character other than {ONE_OF}, got 'HH'"),
    (('.G',), {'legend': {'#': Letter()}},
     f"a letter of the legend must be one character other than {ONE_OF}, got '#'"),
    (('.G',), {'legend': {' ': Letter()}},
     f"a letter of the legend must be one character other than {ONE_OF}, got ' '"),
    (('.G',), {'legend': {'H': Letter(ends=True, to='start')}},
     "a letter either ends the episode or leads to a cell, got 'H' with both"),
    (('.G',), {'legend': {'A': Letter(on_leaving=True)}},
     "a letter that acts on leaving must lead to a cell, got 'A' without"),
    (('.G',), {'legend': {'A': Letter(to=(2, 0))}},
     "'A' must lead to a cell in the grid of 2 x 1 cells, got (2, 0)"),
    (('.#G',), {'legend': {'A': Letter(to=(1, 0))}},
     "'A' must lead to a cell where one can stay, but (1, 0) is '#'"),
    (('.AB.G',), {'legend': {'A': Letter(to=(2, 0)), 'B': Letter(to=(3, 0))}},
     "'A' must lead to a cell where one can stay, but (2, 0) is 'B'"),
    (('.G',), {'starts': ()}, 'a map needs at least one start, got none'),
    (('.G',), {'starts': (2,)}, 'a start must lie in the grid of 2 cells, got state 2'),
    (('.#G',), {'starts': (1,)},
     "a start must be a cell where an episode can begin, but (1, 0) is '#'"),
    (('.G',), {'starts': (1,)},
     "a start must be a cell where an episode can begin, but (1, 0) is 'G'"),
    (('.CG',), {'starts': (1,), 'legend': {'C': Letter(to='start')}},
     "a start must be a cell where an episode can begin, but (1, 0) is 'C'"),
    (('.G',), {'walls': ((0, 0, 1, 1),)}, 'a wall must go along a row or a column, from one '
     'corner to another, got (0, 0) to (1, 1)'),
    (('.G',), {'walls': ((1, 1, 1, 1),)}, 'a wall must go along a row or a column, from one '
     'corner to another, got (1, 1) to (1, 1)'),
    (('.G',), {'walls': ((1, 0, 1, 2),)},
     'a wall must lie in the grid of 2 x 1 cells, got (1, 0) to (1, 2)'),
    (('.G',), {'wind': Wind()}, 'wind needs either columns or rows, got none'),
    (('.G',), {'wind': Wind((0, 0), (0,))}, 'wind needs either columns or rows, got both'),
    (('.G',), {'wind': Wind((1,))}, 'wind must have one number for each of the 2 columns, got 1'),
    (('.G',), {'wind': Wind(rows=(1, 1))},
     'wind must have one number for each of the 1 rows, got 2'),
    (('.G',), {'wind': Wind((0, -101))}, 'wind may be at most 100 cells, got 101'),
    (('.G',), {'wind': Wind((0, 1), chance=1.5)},
     'the chance of wind must lie in [0, 1], got 1.5'),
    (('.G',), {'wind': Wind((0, 1), gusts={1: 0.75, -1: 0.5})},
     'the chances of gusts must not exceed 1 in sum, got 1.25'),
])
def test_wrong_rules_are_rejected_with_the_rule_that_they_break(rows, changes, message):
    with pytest.raises(MapError) as error:
        rules(*rows, **changes)
    assert str(error.value) == message


def test_a_map_without_an_end_can_say_that_it_continues():
    assert rules('..', continuing=True).limit == 20
