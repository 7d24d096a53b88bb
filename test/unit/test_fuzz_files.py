# SPDX-License-Identifier: Apache-2.0
"""Random files: an error of one line, or a correct result."""

from math import isfinite
import time

from hypothesis import example, given
from hypothesis import strategies as st
import pytest
import yaml

from comply_ros.experiments.sweep_yaml import (
    MAX_RUNS,
    MAX_VALUE_LENGTH,
    parse_sweep,
    read_sweep,
    SweepFileError,
)
from comply_ros.experiments.training_runs import validate_run
from comply_ros.learner.presets import METHODS
from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.mentor.policy_text import format_policy, parse_policy
from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.storage.map_files import parse_map, read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.storage.text_and_yaml_files import load_yaml
from comply_ros.world.grid import CELLS, Grid, MapError
from comply_ros.world.mdp import World
from comply_ros.world.transition_table import Table
from examples import examples

fuzz = examples(100)
LONGEST = 300  # characters of a message, without the choices that it offers
SLOWEST = 3.0  # seconds of processor for a small file

MAP = """intended: 0.8
step_limit: 50
rewards: {step: -1, obstacle: -5, goal: 10}
profiles: {published: {obstacle: -2.5}}
slips_bump: true
starts: [[0, 0]]
rows: ['..G', '.#.']
"""
NEW_MAP = """rewards: {step: 0, obstacle: -5, goal: 10, edge: -1, wall: -2}
legend: {H: {reward: -1, ends: true}, C: {to: start}, A: {to: [0, 0], when: leave}}
edges: bump
moves: 8
stay: true
slips: {90: 0.1, stay: 1/4}
walls: [[[1, 0], [1, 2]]]
wind: {columns: [0, 1, 0, 2], chance: 0.5, gusts: {-1: 1/3}}
rows: ['.HCG', '>A..', 'S.#.']
"""
TAXI = """world: taxi
rewards: {step: -1, deliver: 20, wrong: -10}
walls: [[[2, 0], [2, 1]]]
step_limit: 20
rows: ['R..G', '.#..']
"""
TRACK = """world: racetrack
noise: 0.1
largest_speed: 2
rewards: {step: -1}
rows: ['#.F', 'S.#']
"""
SWEEP = """map: bar_grid
methods: [beta_implicit, explicit]
mentors: [optimal, 'noisy:0.2', 'snapshot:0.75@0.2']
settings: {temperature: [0.5, 1], iterations: 100}
budgets: [0, 20]
advising: early
seeds: 3
"""
POLICY = '>>G\n^#^\n'
WORLD = World(parse_map(MAP, 'report'))
ODD = [
    '0', '-1', '1e999', '.nan', '-.inf', '1' + '0' * 400, '0x' + 'f' * 5000, '1:30', '0b_',
    '1' + ':1' * 300 + '.5', 'null', '~', 'true', '2001-02-30', '2001-01-01', '[]', '{}', '[[]]',
    '!!int ""', '!!float ""', '!!bool x', '!!timestamp x', '!!binary x', '!!set {a}', '!!omap 1',
    '!!seq x', '!!map x', '!!python/object/apply:os.getcwd []', '!x y', '"\\UFFFFFFFF"',
    '"\\ud800"', '"a\\0b"', "'a\n  b'", '"\\n"', '*a', '&a [*a]', '&a {? *a : 1}',
    '{<<: [{}]}', '{<<: 1}', '=', '<<', '١٢', 'x' * 3000, '[' * 1500, '- - -', '? ?', '%', '@',
    '`', '|', '>-', '# x', '~root/../x', '/dev/zero', '/', '.', 'file:/', 'file:~nobody-at-all',
    'none@1@1']
numbers = st.one_of(st.integers(), st.floats()).map(str)
values = st.one_of(
    st.sampled_from(ODD), numbers, st.text(max_size=20),
    st.recursive(st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.dates(),
                           st.text(max_size=5)),
                 lambda each: st.lists(each, max_size=4) | st.dictionaries(
                     st.text(max_size=3), each, max_size=3), max_leaves=8).map(
        lambda value: yaml.safe_dump(value, default_flow_style=True).removesuffix('\n...\n')))


@st.composite
def spoiled(draw, text):
    """Draw the text of a file with a few mistakes in it."""
    for _ in range(draw(st.integers(1, 3))):
        text = draw(st.sampled_from([flipped, cut, swapped, doubled, replaced]))(draw, text)
    return text


def place(draw, text):
    """Draw a place in a text."""
    return draw(st.integers(0, len(text)))


def flipped(draw, text):
    """Return the text with another character."""
    k = place(draw, text)
    return text[:k] + draw(st.characters(exclude_categories=())) + text[k + 1:]


def cut(draw, text):
    """Return the text without a part of it."""
    begin, end = sorted((place(draw, text), place(draw, text)))
    return text[:begin] + text[end:]


def swapped(draw, text):
    """Return the text with its lines in another order."""
    return '\n'.join(draw(st.permutations(text.split('\n'))))


def doubled(draw, text):
    """Return the text with a line twice."""
    return '\n'.join((text, draw(st.sampled_from(text.split('\n')))))


def replaced(draw, text):
    """Return the text with another value behind a colon, a comma or a bracket."""
    places = [k + 1 for k, sign in enumerate(text) if sign in ':,[']
    if not places:
        return text + draw(values)
    begin = draw(st.sampled_from(places))
    end = min((k for k in range(begin, len(text)) if text[k] in ',]}\n'), default=len(text))
    return text[:begin] + ' ' + draw(values) + text[end:]


def outcome(function, mistakes, *arguments, longest=LONGEST):
    """Return what a function returns, None after a mistake with a good message."""
    begin = time.process_time()
    try:
        return function(*arguments)
    except mistakes as mistake:
        message = str(mistake)
        without_choices = message
        for table in METHODS.values():
            without_choices = without_choices.replace(', '.join(table), '')
        without_choices = without_choices.partition('; it has off_policy, ')[0]
        assert message and message.isprintable() and len(without_choices) <= longest, message
        return None
    finally:
        assert time.process_time() - begin < SLOWEST


def check_grid(text, found):
    """Fail unless a grid keeps all rules and says what the text says."""
    width, height = len(found.rows[0]), len(found.rows)
    assert all(len(row) == width and set(row) <= set(CELLS) for row in found.rows)
    numbers = found.step_reward, found.obstacle_reward, found.goal_reward
    assert all(type(number) is float and isfinite(number) for number in numbers)
    assert max(numbers[:2]) < 0 and 0 < found.intended <= 1
    assert type(found.step_limit) is int and 1 <= found.step_limit <= 1_000_000
    assert found.starts and all(0 <= s < width * height for s in found.starts)
    for s in found.starts:
        assert reaches_goal(found.rows[::-1], s % width, s // width)
    content = load_yaml(text).value
    if 'extends' not in content:
        assert content['rows'] == list(found.rows)
        assert content['intended'] == found.intended or isinstance(content['intended'], str)
        assert content.get('step_limit', 10 * width * height) == found.step_limit
        if isinstance(content['starts'], list):
            assert [[s % width, s // width] for s in found.starts] == content['starts']


def check_table(found):
    """Fail unless a table is a finite MDP."""
    states = len(found.terminal)
    assert found.starts and all(0 <= s < states for s in found.starts)
    assert not found.terminal[list(found.starts)].any()
    assert all(map(isfinite, found.reward)) and (found.probability > 0).all()
    assert 1 <= found.step_limit <= 1_000_000


def reaches_goal(rows, x, y):
    """Tell whether a way leads from a free cell to a goal: rows bottom first."""
    assert rows[y][x] == '.'
    seen, border = {(x, y)}, [(x, y)]
    while border:
        x, y = border.pop()
        if rows[y][x] == 'G':
            return True
        beside = {(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)} - seen
        border += [(u, v) for u, v in beside if 0 <= v < len(rows) and 0 <= u < len(rows[v])
                   and rows[v][u] != '#']
        seen |= beside
    return False


@fuzz
@given(st.one_of(st.text(), spoiled(MAP)), st.sampled_from(list(METHODS)))
@example(MAP.replace('50', '!!int ""'), 'report')
def test_the_text_of_a_map_is_a_grid_or_an_error_of_one_line(text, profile):
    found = outcome(parse_map, MapError, text, profile)
    if type(found) is Grid:
        check_grid(text, found)
    elif found is not None:
        check_table(found)


@fuzz
@given(st.one_of(spoiled(NEW_MAP), spoiled(TAXI), spoiled(TRACK)))
@example(NEW_MAP)
@example(TAXI)
@example(TRACK)
def test_the_text_of_a_map_with_new_keys_is_a_world_or_an_error_of_one_line(text):
    found = outcome(parse_map, MapError, text, 'report')
    if type(found) is Table:
        check_table(found)


@fuzz
@given(st.one_of(st.text(), spoiled(POLICY)))
@example('>>G\n^#^\x1c')
def test_the_text_of_a_policy_is_a_policy_or_an_error_of_one_line(text):
    policy = outcome(parse_policy, PolicyError, text, WORLD)
    if policy is not None:
        assert format_policy(policy, WORLD).split() == text.split()
        assert (parse_policy(format_policy(policy, WORLD), WORLD) == policy).all()


@fuzz
@given(st.one_of(st.text(), spoiled(SWEEP)))
@example(SWEEP.replace('seeds: 3', 'seeds: 3\n%'))
def test_the_text_of_a_sweep_is_runs_that_can_be_or_an_error_of_one_line(text):
    sweep = outcome(parse_sweep, SweepFileError, text,
                    longest=LONGEST + MAX_VALUE_LENGTH)
    if sweep is not None:
        assert 1 <= len(sweep) <= MAX_RUNS
        runs = [sweep.run(number) for number in {0, len(sweep) // 2, len(sweep) - 1}]
        assert len(set(runs)) == len(runs)
        for run in runs:
            validate_run(run)


@pytest.fixture(scope='module')
def path(tmp_path_factory):
    """Return the path of a file that every example writes anew."""
    return tmp_path_factory.mktemp('fuzz') / 'file'


def spoiled_bytes(text):
    """Return bytes, or the text with some bytes of it replaced."""
    whole = text.encode()
    few = st.lists(st.tuples(st.integers(0, len(whole) - 1), st.integers(0, 255)), max_size=3)
    return st.one_of(st.binary(), few.map(lambda changes: with_bytes(whole, changes)))


def with_bytes(whole, changes):
    """Return bytes with those at some places replaced."""
    spoiled = bytearray(whole)
    for k, byte in changes:
        spoiled[k] = byte
    return bytes(spoiled)


@fuzz
@given(content=spoiled_bytes(MAP))
def test_the_bytes_of_a_map_are_a_grid_or_an_error_of_one_line(path, content):
    path.write_bytes(content)
    found = outcome(read_map, MapError, path, 'published')
    assert found is None or type(found) in (Grid, Table)


@fuzz
@given(content=spoiled_bytes(POLICY))
def test_the_bytes_of_a_policy_are_advice_or_an_error_of_one_line(path, content):
    path.write_bytes(content)
    spec = outcome(read_mentor_spec, MentorError, f'file:{path}')
    advice = spec and outcome(mentor_policy, PolicyError, spec, WORLD, 0)
    assert advice is None or format_policy(advice, WORLD).split() == content.decode().split()


@fuzz
@given(content=spoiled_bytes(SWEEP))
def test_the_bytes_of_a_sweep_are_runs_or_an_error_of_one_line(path, content):
    path.write_bytes(content)
    sweep = outcome(read_sweep, SweepFileError, path)
    assert sweep is None or 1 <= len(sweep) <= MAX_RUNS


@fuzz
@given(st.one_of(st.text(), spoiled('file:/nowhere'), spoiled('snapshot:0.75@0.2')))
@example('none' + '@1' * 2000)
def test_a_mentor_is_known_or_an_error_of_one_line(text):
    spec = outcome(read_mentor_spec, MentorError, text, longest=LONGEST + len(repr(text)))
    assert spec is None or 0 <= spec.coverage <= 1
