# SPDX-License-Identifier: Apache-2.0
"""The keys of a map that only a `Table` has: what they mean, and every wrong value."""

import pytest

from comply_ros.storage.cell_rules_yaml import parse_cell_rules
from comply_ros.storage.map_files import parse_map
from comply_ros.world.cell_rules import Letter
from comply_ros.world.grid import MapError
from comply_ros.world.wind import Wind

MAP = """
rewards: {{step: -1, goal: 10}}
rows: ['S..G']
{}
"""


def rules(**keys):
    """Return the rules of a map of one row with these keys."""
    return parse_cell_rules({'rows': ['..HG'], 'legend': {'H': {}}, **keys},
                            {'step': -1.0, 'goal': 10.0}, (0,))


def test_without_its_keys_a_map_has_the_moves_of_a_grid():
    made = rules()
    assert (made.moves, made.stay, made.edges_bump, made.intended) == (4, False, False, 1.0)
    assert (made.slips, made.slips_bump, made.walls, made.wind) == ('other', True, (), None)
    assert made.obstacle_reward == made.edge_reward == made.wall_reward == -1.0
    assert made.legend == {'H': Letter(), 'G': Letter(10.0, ends=True)}


def test_a_legend_gives_letters_their_meaning():
    made = rules(legend={'H': {'reward': -3, 'ends': True}, 'C': {'to': 'start'}, 1: {},
                         'A': {'to': [1, 0], 'when': 'leave', 'reward': 0.5}})
    assert made.legend == {
        'H': Letter(-3.0, ends=True), 'C': Letter(to='start'), '1': Letter(),
        'A': Letter(0.5, to=(1, 0), on_leaving=True), 'G': Letter(10.0, ends=True)}


def test_a_legend_can_give_the_goal_another_reward():
    assert rules(legend={'H': {}, 'G': {'reward': 7, 'ends': True}}).legend['G'].reward == 7.0


def test_chances_are_numbers_or_fractions():
    made = rules(slips={90: '1/3', 'stay': 0.25}, wind={'rows': [1], 'gusts': {-1: '1/4'}})
    assert made.slips == {90: 1 / 3, 'stay': 0.25}
    assert made.wind == Wind(rows=(1,), gusts={-1: 0.25})


def test_walls_wind_and_moves():
    made = rules(walls=[[[1, 0], [1, 1]]], moves=8, stay=True, edges='bump',
                 wind={'columns': [0, 1, 0, -2], 'chance': 0.5})
    assert made.walls == ((1, 0, 1, 1),)
    assert (made.moves, made.stay, made.edges_bump) == (8, True, True)
    assert made.wind == Wind(columns=(0, 1, 0, -2), chance=0.5)


@pytest.mark.parametrize('key, message', [
    ('legend: H', 'legend must be a table of letters, such as H: {reward: -1, ends: true}, '
     "got 'H'"),
    ('legend: {S: {}}', 'a letter of the legend must be one character other than . # S < > v ^, '
     "got 'S'"),
    ('legend: {H: 5}', "'H' of the legend must be a table of reward, ends, to, when, got 5"),
    ('legend: {H: {end: true}}', "'H' of the legend must be a table of reward, ends, to, when, "
     "got the key 'end'"),
    ('legend: {H: {reward: low}}', "reward of 'H' must be a number, got 'low'"),
    ('legend: {H: {ends: 1}}', 'ends must be true or false, got 1'),
    ('legend: {H: {to: [1.5, 0]}}',
     "to of 'H' must be start or [x, y], in whole numbers, got [1.5, 0]"),
    ('legend: {H: {to: home}}', "to of 'H' must be start or [x, y], in whole numbers, got 'home'"),
    ('legend: {H: {to: start, when: never}}', "when of 'H' must be enter or leave, got 'never'"),
    ('moves: king', "moves must be 4 or 8, got 'king'"),
    ('moves: 6', 'moves must be 4 or 8, got 6'),
    ('stay: 1', 'stay must be true or false, got 1'),
    ('edges: soft', "edges must be absent or bump, got 'soft'"),
    ('slips: 0.1', 'slips must be a table of chances, got 0.1'),
    ('slips: often', "slips must be other, right_angles or a table of chances, got 'often'"),
    ('slips: {90: rare}', "a chance of slips must be a number, got 'rare'"),
    ('walls: 1', 'walls must be a list of [[x, y], [x, y]], got 1'),
    ('walls: [[[0, 0]]]', 'a wall must go from corner to corner, [[x, y], [x, y]] in whole '
     'numbers, got [[0, 0]]'),
    ('walls: [[[0, 0], [0.5, 0]]]', 'a wall must go from corner to corner, [[x, y], [x, y]] in '
     'whole numbers, got [[0, 0], [0.5, 0]]'),
    ('wind: 1', 'wind must be a table of columns, rows, chance, gusts, got 1'),
    ('wind: {column: [1]}', 'wind must be a table of columns, rows, chance, gusts, got '
     "the key 'column'"),
    ('wind: {rows: 1}', 'wind of rows must be a list of whole numbers, got 1'),
    ('wind: {rows: [0.5]}', 'wind of rows must be a list of whole numbers, got [0.5]'),
    ('wind: {rows: [1], chance: often}', "the chance of wind must be a number, got 'often'"),
    ('wind: {rows: [1], gusts: 1}', 'gusts must be a table of chances, got 1'),
    ('wind: {rows: [1], gusts: {up: 0.5}}', 'gusts must be chances of changes in whole cells, '
     "such as 1: 0.3, got 'up'"),
    ('continuing: 1', 'continuing must be true or false, got 1'),
    ('slips_bump: 1', 'slips_bump must be true or false, got 1'),
    ('cell_size: big', "cell_size must be a number, got 'big'"),
    ('step_limit: 0.5', 'step_limit must be a whole number, got 0.5'),
    ('intended: 1/x', "intended must be a number, got '1/x'"),
])
def test_a_wrong_key_is_rejected_with_the_rule_that_it_breaks(key, message):
    with pytest.raises(MapError) as error:
        parse_map(MAP.format(key), 'report')
    assert str(error.value) == message
