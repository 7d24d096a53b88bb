# SPDX-License-Identifier: Apache-2.0
"""Files of users as other programs leave them: byte order marks, CRLF, blanks, no last newline."""

import pytest

from comply_ros.experiments.sweep_yaml import read_sweep
from comply_ros.mentor.policy_text import format_policy
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.storage.policy_files import read_policy
from comply_ros.storage.text_and_yaml_files import dump_yaml, load_yaml, YamlError
from comply_ros.world.mdp import World

MAP = """\
intended: 0.8
step_limit: 50
rewards: {step: -1, obstacle: -5, goal: 10}
starts: [[0, 0]]
rows:
- ..G
- .#.
"""
POLICY = '>>G\n^#^\n'
SWEEP = """\
methods: [sarsa, explicit]
mentors:
- none
seeds: 3
"""
TOUCHES = {
    'a byte order mark': lambda text: '\ufeff' + text,
    'CRLF': lambda text: text.replace('\n', '\r\n'),
    'CR': lambda text: text.replace('\n', '\r'),
    'no last newline': lambda text: text.rstrip('\n'),
    'trailing blanks': lambda text: text.replace('\n', '  \n'),
    'trailing tabs': lambda text: text.replace('\n', '\t\n'),
    'blank lines': lambda text: text + ' \n\n',
    'all of it': lambda text: '\ufeff' + text.rstrip('\n').replace('\n', ' \r\n') + ' '}


@pytest.fixture(params=TOUCHES)
def touched(request, tmp_path):
    """Return a function that writes a text as another program does, and returns the path."""
    def write(text):
        path = tmp_path / 'file'
        path.write_bytes(TOUCHES[request.param](text).encode())
        return path
    return write


@pytest.fixture
def world(tmp_path):
    """Return the world of the map as we write it."""
    (tmp_path / 'plain').write_text(MAP)
    return World(read_map(str(tmp_path / 'plain'), 'report'))


def test_a_map_is_the_same(touched, world):
    assert read_map(str(touched(MAP)), 'report') == world.grid


def test_a_policy_is_the_same(touched, world):
    path = touched(POLICY)
    assert format_policy(read_policy(path, world), world) == POLICY
    spec = read_mentor_spec(f'file:{path}')
    assert format_policy(mentor_policy(spec, world, 0), world) == POLICY


def test_a_sweep_is_the_same(touched, tmp_path):
    (tmp_path / 'plain').write_text(SWEEP)
    assert read_sweep(touched(SWEEP)) == read_sweep(tmp_path / 'plain')


@pytest.mark.parametrize('text, place, line', [
    ('a: 1\nb: 2', ('b',), 2),
    ('a:\n- 1\n- 2', ('a', 1), 3), ('a:\n  b:\n    c: 1', ('a', 'b'), 2),
    ('a: [1,\n  2]', ('a', 1), 2), ('# c\n\na: 1', ('a',), 3), ('a: 1', ('a', 7), 1),
    ('a: 1\r\nb: 2', ('b',), 2)])
def test_every_value_has_its_line(text, place, line):
    assert load_yaml(text).line_of(place) == line


@pytest.mark.parametrize('text, line, message', [
    ('a: 1\nb: 2\na: 3', 3, "a key must be there once, got 'a' again"),
    ('a:\n  b: 1\n  "b": 1', 3, "a key must be there once, got 'b' again"),
    ('{a: 1, a: 2}', 1, "a key must be there once, got 'a' again"),
    ('a: 1\nb: 0x10', 2, "a number must be written like 10, 0.5 or 1e-3, got '0x10'"),
    ('a: ' + '9' * 51, 1, f"a number may have at most 50 characters, got '{'9' * 51}'"),
    ('&a [*a]', 1, 'got a value inside itself'), ('[\n' * 2000, 1, 'got too many brackets'),
    ('a: 1\nb: !!bool x', 2, 'got a value that is not of its tag')])
def test_an_error_has_its_line(text, line, message):
    with pytest.raises(YamlError) as caught:
        load_yaml(text)
    assert (caught.value.line, str(caught.value)) == (line, message)


def test_aliases_and_merged_tables_are_what_they_stand_for():
    found = load_yaml('base: &b {x: 1, on: &t true}\nmore: {<<: *b, y: *t}')
    assert found.value == {'base': {'x': 1, 'on': True}, 'more': {'x': 1, 'on': True, 'y': True}}
    assert type(found.value['more']['y']) is bool and type(found.value['base']) is dict


def test_what_is_written_is_read_again():
    table = {'image': 'a b.pgm', 'slips': {90: 1e-05, -90: 0.1}, 'flag': True, 'none': None,
             'rows': ['..G', '#', ''], 'number': -2.5e+300, 'text': 'yes: no # \u00e4'}
    assert load_yaml(dump_yaml(table)).value == table
