# SPDX-License-Identifier: Apache-2.0
"""The file of a sweep, and every error message about one."""

from pathlib import Path
import time

import pytest

from comply_ros.experiments.sweep_yaml import parse_sweep, read_sweep, SweepFileError
from comply_ros.experiments.training_runs import Run
from comply_ros.storage.map_name import map_names

TOP = Path(__file__).parents[2]
GOOD = """
map: bar_grid
methods: [beta_implicit, explicit]
mentors:
- optimal
- snapshot:0.75@0.2
settings:
  temperature: [0.5, 1]
  iterations: 100
seeds: 3
"""


def test_a_file_is_all_combinations():
    sweep = parse_sweep(GOOD)
    assert len(sweep) == 2 * 2 * 2 * 3
    assert list(sweep.axes) == ['map', 'profile', 'mentor', 'mentor_seed', 'budget', 'advising',
                                'method', 'temperature', 'iterations', 'seed']
    assert sweep.run(0) == Run(
        'bar_grid', 'published', 'beta_implicit', (('temperature', 0.5), ('iterations', 100)),
        'optimal')
    assert sweep.axes['mentor'] == ('optimal', 'snapshot:0.75@0.2')
    assert sweep.axes['temperature'] == (0.5, 1.0)
    assert isinstance(sweep.axes['temperature'][1], float)
    assert sweep.axes['seed'] == (0, 1, 2)


def test_optional_keys_are_read():
    sweep = parse_sweep('{map: [bar_grid, maze], profile: [report, published], methods: sarsa, '
                        'mentors: none, mentor_seeds: [4, 9], budgets: [0, 20], '
                        'advising: [early, mistakes], seeds: [7]}')
    assert len(sweep) == 2 ** 5
    assert sweep.run(31) == Run('maze', 'published', 'sarsa', (), 'none', 9, 20, 'mistakes', 7)


def test_the_example_is_valid():
    assert len(read_sweep(TOP / 'config' / 'sweep.yaml')) == 120


WRONG = [
    ('explicit]', 'sarse]', "line 3: did you mean 'sarsa'? a method must be one of sarsa, "),
    ('explicit]', '7]', 'line 3: methods must be words, got 7'),
    ('explicit]', 'beta_implicit]',
     "line 3: methods must differ from each other, got 'beta_implicit' twice"),
    ('[beta_implicit, explicit]', '[]', 'line 3: methods must have a value, got an empty list'),
    ('explicit]', '[explicit]]', 'line 3: each of methods must be a single value, got a list'),
    ('explicit]', 'explicit', "line 3: a sweep must be valid YAML (expected ',' or ']'"),
    ('methods', 'method', 'line 3: a sweep has the keys map, profile, mentors, '),
    ('seeds: 3', '', "line 2: a sweep needs the key 'seeds'"),
    ('seeds: 3', 'seeds: 0', 'line 10: the number of seeds must lie in [1, 1000000], got 0'),
    ('seeds: 3', 'seeds: many', "line 10: seeds must be whole numbers, got 'many'"),
    ('seeds: 3', 'seeds: [1, -1]',
     'line 10: each of seeds must lie in [0, 9007199254740992], got -1'),
    ('seeds: 3', 'seeds: 1000000', 'line 10: a sweep may have at most 1000000 runs, got 8000000'),
    ('seeds: 3', 'seeds: 3\nseeds: 4', "line 11: a key must be there once, got 'seeds' again"),
    ('seeds: 3', 'seeds: 3\nbudgets: -1', 'line 11: budget must be at least 0, got -1'),
    ('seeds: 3', 'seeds: 3\nadvising: late', 'line 11: advising must be one of early, '),
    ('seeds: 3', 'seeds: 3\nprofile: new', 'line 11: a profile must be one of report, '),
    ('seeds: 3', 'seeds: !!int x',
     "line 10: a number must be written like 10, 0.5 or 1e-3, got 'x'"),
    ('seeds: 3', 'seeds: 3 \x07', 'line 10: a sweep must be valid YAML, got the character'),
    ('seeds: 3', "seeds: 'a", 'line 10: a sweep must be valid YAML ('),
    ('bar_grid', 'nowhere', "line 2: map 'nowhere': a map must be one of "),
    ('- optimal', '- good', 'line 5: a mentor must be one of optimal, '),
    ('- optimal', '- 0.5', 'line 5: mentors must be words, got 0.5'),
    ('- optimal', '- noisy:2', "line 5: the P of noisy:P must lie in [0, 1], got '2'"),
    ('- optimal', '- file:/nowhere', "line 5: a policy file must be readable, got '/nowhere'"),
    ('- optimal', '- learner:/robot_2', 'line 5: a mentor that follows a running learner must be '
     'a node of its own, started with -p mentor:=learner:/robot_2; here, use learned:FILE.npz'),
    ('temperature', 'heat', "line 8: a method has no field 'heat'"),
    ('[0.5, 1]', '[0.5,\n  -1]', 'line 9: temperature must lie in [1e-09, 1000000], got -1.0'),
    ('[0.5, 1]', '[0.5, warm]', "line 8: temperature must be a number such as 1.0, got 'warm'"),
    ('[0.5, 1]', '[1, 1.0]', 'line 8: temperature must differ from each other, got 1.0 twice'),
    ('iterations: 100', 'iterations: 0', 'line 9: a run needs an end: iterations must be at'),
    ('iterations: 100', 'trust_rate: 2', 'line 9: trust_rate must lie in [0, 1] where trust is '
     'explicit, got 2.0'),
    (GOOD, 'settings: 3', 'line 1: a sweep needs the key '),
    ('seeds: 3', 'seeds: ' + '9' * 60,
     "line 10: a number may have at most 50 characters, got '999"),
    ('seeds: 3', 'seeds: !!int ""',
     "line 10: a number must be written like 10, 0.5 or 1e-3, got ''"),
    ('seeds: 3', 'seeds: 010',
     "line 10: a number must be written like 10, 0.5 or 1e-3, got '010'"),
    ('seeds: 3', 'seeds: [1, 1:30]', "line 10: seeds must be whole numbers, got '1:30'"),
    ('seeds: 3', 'seeds: 1e3', 'line 10: seeds must be whole numbers, got 1000.0'),
    ('seeds: 3', 'seeds: !!bool x', 'line 10: a sweep must be valid YAML, got a value that is not '
     'of its tag'),
    ('seeds: 3', '? !!seq a\n: 3', 'line 10: a sweep must be valid YAML (expected a sequence'),
    ('seeds: 3', 'seeds: "\\UFFFFFFFF"',
     'line 1: a sweep must be valid YAML, got a number beyond'),
    (GOOD, f'%YAML {"9" * 5000}.1\n---\na: b', 'line 1: a sweep must be valid YAML, got a number'),
    (GOOD, '[\n' * 2000, 'line 1: a sweep must be valid YAML, got too many brackets'),
    ('iterations: 100', f'iterations: "{"9" * 400}"', 'line 9: iterations must lie in [0, 1000'),
    ('bar_grid', '"a\\0b"', f"line 2: map 'a\\x00b': a map must be one of {', '.join(map_names())}"
     ', gym:NAME, nav2:FILE, garnet:SEED or a readable file (no file can have this name)'),
    ('bar_grid', 'b' * 1001, "line 2: map may have at most 1000 characters, got 'bbb"),
    ('- optimal', '- file:~nobody-at-all/p', 'line 5: a policy file must be readable, got '
     "'~nobody-at-all/p' (no such user)"),
    (GOOD, '- a', 'line 1: a sweep must be a table of map, '),
    (GOOD, '', 'line 1: a sweep must be a table of map, profile, mentors, mentor_seeds, budgets, '
     'advising, methods, settings, seeds, got nothing'),
    ('settings:\n  temperature: [0.5, 1]\n  iterations: 100', 'settings: 3',
     'line 7: settings must be a table of fields of the methods, got 3'),
]


@pytest.mark.parametrize('old, new, message', WRONG)
def test_a_mistake_names_the_file_the_line_the_rule_and_the_value(tmp_path, old, new, message):
    path = tmp_path / 'sweep.yaml'
    path.write_text(GOOD.replace(old, new))
    with pytest.raises(SweepFileError) as caught:
        read_sweep(path)
    assert str(caught.value).startswith(f'{path}, {message}')
    assert '\n' not in str(caught.value)


def test_a_policy_that_does_not_fit_one_of_the_maps_is_an_error(tmp_path):
    (tmp_path / 'mine.txt').write_text('>>G\n')
    with pytest.raises(SweepFileError, match='line 5: a policy must have a row for each'):
        parse_sweep(GOOD.replace('optimal', f'file:{tmp_path}/mine.txt'))


def test_a_map_in_which_planning_does_not_settle_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr('comply_ros.world.planning.MOST_SWEEPS', 3)
    (tmp_path / 'mine.yaml').write_text(
        (TOP / 'comply_ros' / 'maps' / 'bar_grid.yaml').read_text())
    with pytest.raises(SweepFileError, match='line 2: value iteration must settle within 3'):
        parse_sweep(GOOD.replace('bar_grid', f'{tmp_path}/mine.yaml'))


@pytest.mark.parametrize('content, reason', [
    (None, 'no such file or directory'), (b'\xff\xfe', 'it is not text')])
def test_an_error_names_a_file_that_cannot_be_read(tmp_path, content, reason):
    path = tmp_path / 'sweep.yaml'
    if content:
        path.write_bytes(content)
    with pytest.raises(SweepFileError) as caught:
        read_sweep(path)
    assert str(caught.value) == f"a sweep file must be readable, got '{path}' ({reason})"


def test_ten_thousand_seeds_are_checked_fast():
    begin = time.process_time()
    assert len(parse_sweep(GOOD.replace('seeds: 3', 'seeds: 10000'))) == 80_000
    assert time.process_time() - begin < 5.0


def test_settings_that_depend_on_each_other_are_checked_together():
    text = GOOD.replace('temperature: [0.5, 1]', 'trust: explicit\n  trust_rate: [0.5, 1.0]')
    assert len(parse_sweep(text)) == 24
    with pytest.raises(SweepFileError, match='line 8: trust_rate must lie in .* got 2.0'):
        parse_sweep(text.replace('1.0]', '2.0]'))


def test_too_many_runs_are_an_error():
    many = ', '.join(f'0.{k:02}' for k in range(100))
    fields = ('discount', 'learning_rate', 'trace_decay', 'trace_floor', 'confidence',
              'confidence_factor', 'exploration_probability', 'trust_rate_factor')
    text = GOOD.replace('seeds: 3', 'seeds: 1000000').replace(
        'temperature: [0.5, 1]', '\n  '.join(f'{field}: [{many}]' for field in fields))
    with pytest.raises(SweepFileError, match='at most 1000000 runs, got 4' + '0' * 22 + '$'):
        parse_sweep(text)


@pytest.mark.parametrize('old, new, message', [
    ('- optimal', '- random\n- optimal', "line 6: a mentor of the kind 'optimal' must plan"),
    ('- optimal\n- snapshot:0.75@0.2', '- random\nbudgets: 3\nadvising: [early, important]',
     "line 7: advising 'important' must know what an action leads to")])
def test_what_needs_a_model_is_rejected_where_there_is_none(old, new, message):
    pytest.importorskip('gymnasium')
    with pytest.raises(SweepFileError, match=message):
        parse_sweep(GOOD.replace('bar_grid', 'gym:MountainCar-v0?bins=8').replace(old, new))
