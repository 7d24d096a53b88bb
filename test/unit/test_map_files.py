# SPDX-License-Identifier: Apache-2.0
"""Maps from files."""

from dataclasses import replace
from pathlib import Path
import re

import numpy as np
import pytest

from comply_ros.storage import text_and_yaml_files
from comply_ros.storage.map_files import KEYS, parse_map, read_map
from comply_ros.storage.map_name import map_names
from comply_ros.world.grid import Grid, MapError
from comply_ros.world.transition_table import Table

SMALL = """
intended: 0.8
step_limit: 50
rewards: {step: -1, obstacle: -5, goal: 10}
starts: [[0, 0]]
rows: ['..G', '.#.']
"""


def test_the_maps_that_come_with_the_package():
    assert map_names() == [
        'bar_grid', 'cliff_walking', 'four_rooms', 'free_grid', 'frozen_lake', 'frozen_lake_8x8',
        'maze', 'maze_as_run', 'racetrack', 'stochastic_windy', 'taxi', 'windy']


def test_maze_is_that_of_the_report():
    maze = read_map('maze', 'report')
    cells = np.array(list(maze.cells)).reshape(41, 41)  # [y, x]
    assert cells[20, 20] == 'G'
    assert (cells == '#').sum() == 484
    assert (cells[6:17, 24:35] == '#').all()
    assert maze.starts == (0, 40, 1640, 1680)
    assert (maze.step_reward, maze.obstacle_reward, maze.goal_reward) == (-0.1, -10.0, 10.0)
    assert (maze.intended, maze.step_limit) == (0.95, 320)


@pytest.mark.parametrize('profile', ['report', 'published'])
def test_the_maze_as_run_differs_in_its_slips_alone(profile):
    maze, as_run = (read_map(name, profile) for name in ('maze', 'maze_as_run'))
    assert maze.slips_bump and not as_run.slips_bump
    assert replace(as_run, slips_bump=True) == maze


def test_a_profile_changes_rewards():
    assert read_map('maze', 'published').obstacle_reward == -5.0


@pytest.mark.parametrize('name, free', [('free_grid', 120), ('bar_grid', 113)])
def test_the_small_grids_start_anywhere(name, free):
    small = read_map(name, 'report')
    assert len(small.starts) == free
    assert small.intended == 0.9
    assert small.goal_reward == 1.0


def test_a_file_is_a_map_too(tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text(SMALL)
    assert read_map(str(path), 'report') == parse_map(SMALL, 'published')
    assert parse_map(SMALL, 'report').obstacle_reward == -5.0


@pytest.mark.parametrize('old, new, message', [
    ("'..G', '.#.'", "'..G', '.#'",
     'all rows must have the same length: row 2 has 2 cells, row 1 has 3'),
    ("['..G', '.#.']", '1', "rows must be a list of texts such as '..#G', got 1"),
    ('[[0, 0]]', '[[1, 0]]', 'a start must be a free cell, but (1, 0) is an obstacle'),
    ('[[0, 0]]', '[[3, 0]]', 'a start must lie in the grid of 3 x 2 cells, got (3, 0)'),
    ('[[0, 0]]', '[]', 'a map needs at least one start, got none'),
    ('[[0, 0]]', 'corner',
     "starts must be 'anywhere' or a list of [x, y], in whole numbers, got 'corner'"),
    ('0.8', 'often', "intended must be a number, got 'often'"),
    ('50', '5.5', 'step_limit must be a whole number, got 5.5'),
    ('goal: 10', 'gaol: 10', 'rewards must be a table of step, obstacle, goal, edge, wall, got '
     "the key 'gaol'"),
    ('rows:', 'image: a.pgm\nrowz:', 'a map of Nav2 needs a start and a goal: name it as nav2:'
     'FILE?start=X,Y&goal=X,Y, or in the key nav2 of a map file, got only its own keys'),
    (', obstacle: -5', '', "rewards need the key 'obstacle'"),
    ('starts', 'beginnings', f"a map has the keys {', '.join(KEYS)}, got 'beginnings'"),
    ('rows:', 'slips_bump: 1\nrows:', 'slips_bump must be true or false, got 1'),
    ('rows:', 'extends: attic\nrows:',
     f"extends must name one of {', '.join(map_names())}, got 'attic'"),
    ('rows:', 'step_limit: 7\nrows:',
     "a key must be there once, got 'step_limit' again in line 6"),
    ('50', '9' * 51,
     f"a number may have at most 50 characters, got '{'9' * 51}' in line 3"),
    ('0.8', '!!float ""', "a number must be written like 10, 0.5 or 1e-3, got '' in line 2"),
    ('0.8', '!!timestamp x', 'a map must be valid YAML (failed to construct timestamp '
     'from "x") in line 2'),
    ('0.8', '"\\UFFFFFFFF"', 'a map must be valid YAML, got a number beyond all '
     'bounds in line 1'),
    ('rows:', 'profiles: 1\nrows:', 'profiles must be a table of report, published, got 1'),
    ('rows:', 'profiles: false\nrows:',
     'profiles must be a table of report, published, got False'),
    ('rows:', 'profiles: {published: 0}\nrows:',
     'profile published must be a table of step, obstacle, goal, edge, wall, got 0'),
    ('rows:', 'x' * 100 + ': 1\nrows:',
     f"a map has the keys {', '.join(KEYS)}, got '{'x' * 56}..."),
    ('0.8', '1/0', "intended must be a number, got '1/0'"),
    ('0.8', '4/3', 'intended must lie in (0, 1], got 1.3333333333333333'),
    ('rows:', 'rows: [', "a map must be valid YAML (expected ',' or ']', but got "
     "'<stream end>') in line 6"),
])
def test_a_wrong_file_is_rejected_with_the_rule_that_it_breaks(tmp_path, old, new, message):
    path = tmp_path / 'mine.yaml'
    assert old in SMALL
    path.write_text(SMALL.replace(old, new))
    with pytest.raises(MapError) as error:
        read_map(str(path), 'report')
    assert str(error.value) == f'map {str(path)!r}: {message}'


def test_a_map_that_needs_no_more_than_a_grid_has_is_a_grid():
    small = parse_map(SMALL, 'report')
    assert type(small) is Grid
    assert small.sha256 == (
        '8d186366555584ee120c1c8bd68236a87b99f50d169951a61d7da46f6f1232ad')


@pytest.mark.parametrize('name, start', [
    ('bar_grid', 'e42af7bb93f6'), ('free_grid', '757b6864edd4'), ('maze', '5b55dc0501b4'),
    ('maze_as_run', 'a57e2d2c989b')])
def test_the_maps_of_the_report_are_the_worlds_that_they_were(name, start):
    assert read_map(name, 'published').sha256.startswith(start)


def test_a_map_without_a_step_limit_has_ten_times_its_cells():
    assert parse_map(SMALL.replace('step_limit: 50\n', ''), 'report').step_limit == 60


def test_a_map_without_intended_has_no_slips():
    assert parse_map(SMALL.replace('intended: 0.8\n', ''), 'report').intended == 1.0


def test_a_probability_can_be_a_fraction():
    assert parse_map(SMALL.replace('0.8', '1/3'), 'report').intended == 1 / 3


@pytest.mark.parametrize('old, new', [
    ('rows:', 'edges: bump\nrows:'), ('rows:', 'moves: 8\nrows:'), ('rows:', 'stay: true\nrows:'),
    ('rows:', 'slips: right_angles\nrows:'), ('rows:', 'legend: {H: {ends: true}}\nrows:'),
    ('rows:', 'walls: [[[1, 0], [1, 1]]]\nrows:'), ('rows:', 'wind: {rows: [1, 0]}\nrows:'),
    ('rows:', 'continuing: true\nrows:'), ('rows:', 'cell_size: 0.5\nrows:'),
    ('step: -1', 'step: 0'), ('obstacle: -5', 'obstacle: 0'), ('goal: 10', 'goal: 10, edge: -1'),
    ('goal: 10', 'goal: 10, wall: -1'), ("'..G'", "'>.G'"),
    ("starts: [[0, 0]]\nrows: ['..G', '.#.']", "rows: ['..G', 'S#.']")])
def test_a_map_that_needs_more_is_a_table(old, new):
    assert old in SMALL
    table = parse_map(SMALL.replace(old, new), 'report')
    assert type(table) is Table
    assert (table.starts, table.step_limit) == ((0,), 50)


def test_a_profile_changes_the_rewards_of_a_table():
    text = SMALL + 'edges: bump\nprofiles: {published: {edge: -7}}\n'
    assert parse_map(text, 'report').reward.min() == -5.0
    assert parse_map(text, 'published').reward.min() == -7.0


@pytest.mark.parametrize('text, message', [
    ("rewards: {step: 0}\nrows: ['S.Q']", 'a cell must be one of . # G S < > v ^ or a letter of '
     "the legend, got 'Q' in row 1, column 3"),
    ("rewards: {step: 0}\nrows: ['S.G']", "rewards need the key 'goal'"),
    ("rewards: {goal: 0}\nrows: ['S.G']", "rewards need the key 'step'"),
    ("rows: ['S.G']", "a map needs the key 'rewards'"),
    ("rows: ['S.G']\nslips: right_angles", 'a map with slips: right_angles needs the key '
     'intended, the chance that a move does not slip'),
    ("rows: ['S.G']\nslips_bump: false", 'a map with slips_bump: false needs the key intended, '
     'the chance that a move does not slip'),
    ('moves: 8\nrewards: {step: 0}', "a map needs the key 'rows'"),
    ("rewards: {step: 0, goal: 1}\nrows: ['S.G']\nstarts: [[0, 0]]",
     'starts must be given either by the key or by cells S, got both'),
    ("rewards: {step: 0, goal: 1}\nrows: ['..G']\nmoves: 8",
     'starts must be given either by the key or by cells S, got none'),
    ("goals: [[0, 0]]\nrows: ['..G']",
     'goals must be cells G of the rows; the key is for a map with nav2'),
])
def test_a_wrong_map_with_new_cells_is_rejected_with_the_rule_that_it_breaks(text, message):
    with pytest.raises(MapError) as error:
        parse_map(text, 'report')
    assert str(error.value) == message


def examples_of_the_page():
    """Return the maps in docs/how-to/map.md."""
    page = (Path(__file__).parents[2] / 'docs' / 'how-to' / 'map.md').read_text()
    return re.findall(r'```yaml\n(.*?)```', page, re.DOTALL)


@pytest.mark.parametrize('text', examples_of_the_page())
def test_every_map_of_the_page_is_a_map(tmp_path, text):
    (tmp_path / 'house.pgm').write_text('P2 8 4 255 ' + '255 ' * 32)
    (tmp_path / 'house.yaml').write_text(
        'image: house.pgm\nresolution: 0.5\norigin: [-2, -1, 0]\nnegate: 0\n'
        'occupied_thresh: 0.65\nfree_thresh: 0.25\n')
    assert type(parse_map(text.replace('3.0, 1.0', '1.5, 0.5'), 'report', tmp_path)) in (
        Grid, Table)


def test_the_page_names_every_key():
    page = (Path(__file__).parents[2] / 'docs' / 'how-to' / 'map.md').read_text()
    for key in KEYS:
        assert f'`{key}`' in page or f'\n{key}: ' in page or f'`{key}: ' in page, key


@pytest.mark.parametrize('text', ['', '7', '[1, 2]', '\x00', '&a [*a]'])
def test_what_is_no_map_at_all_is_rejected(text):
    with pytest.raises(MapError, match='a map must be'):
        parse_map(text, 'report')


def test_a_map_that_does_not_exist_is_named():
    with pytest.raises(MapError) as error:
        read_map('nowhere', 'report')
    assert str(error.value) == (f"map 'nowhere': a map must be one of {', '.join(map_names())}, "
                                'gym:NAME, nav2:FILE, garnet:SEED or a readable file (no such '
                                'file or directory)')


@pytest.mark.parametrize('path, reason', [
    ('a\0b', 'no file can have this name'), ('\ud800', 'no file can have this name'),
    ('~nobody-at-all/maze', 'no such user'), ('x' * 5000, 'file name too long'),
    ('/dev/zero', 'it has more than 32000000 characters'), ('', 'is a directory')])
def test_a_path_that_is_no_text_file_is_rejected_with_the_reason(path, reason):
    with pytest.raises(MapError) as error:
        read_map(path, 'report')
    assert str(error.value).endswith(f' or a readable file ({reason})')


def nested_aliases(levels, text):
    """Return YAML of a list that stands for 10 ** levels texts."""
    lists = [f'&a0 "{text}"']
    for level in range(1, levels + 1):
        lists.append(f'&a{level} [' + ', '.join([f'*a{level - 1}'] * 10) + ']')
    return '[' + ', '.join(lists) + ']'


@pytest.mark.parametrize('rows', [nested_aliases(12, 'lol'), nested_aliases(3, 'l' * 100_000)])
def test_a_map_that_would_be_large_in_memory_is_rejected(rows):
    with pytest.raises(MapError, match='YAML may have at most 50000 values, got more in line 6'):
        parse_map(SMALL.replace("['..G', '.#.']", rows), 'report')


def test_a_long_list_is_rejected(monkeypatch):
    # The parser takes seconds for 50000.
    monkeypatch.setattr(text_and_yaml_files, 'MAX_VALUES', 500)
    with pytest.raises(MapError, match='YAML may have at most 500 values, got more in line 6'):
        parse_map(SMALL.replace("['..G', '.#.']", '[' + "'.'," * 500 + ']'), 'report')
