# SPDX-License-Identifier: Apache-2.0
"""The file of a sweep: methods x mentors x settings x seeds, and every way it can be wrong."""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from math import prod
from pathlib import Path

import yaml

from comply_ros.experiments import training_runs
from comply_ros.experiments.sweep_grid import Sweep
from comply_ros.experiments.training_runs import config_of, Run
from comply_ros.experiments.yaml_lines import (
    compose,
    fail,
    line_of,
    LinedValue,
    read_table,
    read_values,
    SweepFileError,
)
from comply_ros.learner.learner_config import ConfigError
from comply_ros.mentor.advice_budget import validate_advice_budget
from comply_ros.mentor.mentor_policies import FROM_FILES
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.storage.bounded_yaml import read_text, shown
from comply_ros.storage.file_system import PathError
from comply_ros.storage.mentor_cache import policy_of_file, read_mentor_spec
from comply_ros.terminal.training_options import MISTAKES

AXES = {  # key of the file: field of `Run` and type of its values; the last one varies fastest
    'map': ('map', str), 'profile': ('profile', str), 'mentors': ('mentor', str),
    'mentor_seeds': ('mentor_seed', int), 'budgets': ('budget', int),
    'advising': ('advising', str), 'methods': ('method', str), 'settings': (None, str),
    'seeds': ('seed', int)}
REQUIRED = ('methods', 'mentors', 'seeds')
COUNTS = ('seeds', 'mentor_seeds')  # a single number n stands for 0 to n - 1
MAX_RUNS = 1_000_000


def read_sweep(path: str | Path) -> Sweep:
    """Return the sweep of a file; a SweepFileError names file, line, rule and value."""
    try:
        return parse_sweep(read_text(path))
    except PathError as error:
        raise SweepFileError(
            f'a sweep file must be readable, got {str(path)!r} ({error})') from None
    except SweepFileError as error:
        raise SweepFileError(f'{path}, {error}') from None


def parse_sweep(text: str) -> Sweep:
    """
    Return the sweep of a file's YAML text; a SweepFileError names line, rule and value.

    Every value is checked, but mentors are not generated.
    """
    nodes = _nodes(text)
    axes: dict[str, list[LinedValue]] = {}
    for key, (field, kind) in AXES.items():
        if field is None:
            axes.update(_settings(nodes.get(key)))
        elif key in nodes:
            axes[field] = _axis(key, kind, nodes[key])
        else:
            axes[field] = [LinedValue(getattr(Run(), field), 1)]
    count = prod(map(len, axes.values()))
    if count > MAX_RUNS:
        fail(axes['seed'][0].line, f'a sweep may have at most {MAX_RUNS} runs, got {count}')
    _check_values(axes)
    _check_methods(axes)
    return Sweep({name: tuple(item.value for item in items) for name, items in axes.items()})


def _nodes(text: str) -> dict[str, yaml.Node]:
    """Return the YAML nodes of a file by their keys."""
    root = compose(text)
    table = read_table(root, f'a sweep must be a table of {", ".join(AXES)}')
    for key, (line, _) in table.items():
        if key not in AXES:
            fail(line, f'a sweep has the keys {", ".join(AXES)}, got {shown(key)}')
    for key in REQUIRED:
        if key not in table:
            fail(line_of(root), f'a sweep needs the key {key!r}')
    return {key: node for key, (_, node) in table.items()}


def _axis(key: str, kind: type, node: yaml.Node) -> list[LinedValue]:
    """Return the values of a key, checked for their type and range."""
    items = read_values(key, node)
    for value, line in items:
        if type(value) is not kind:
            fail(line, f'{key} must be {"words" if kind is str else "whole numbers"}, '
                 f'got {shown(value)}')
    if key in COUNTS:
        is_count = isinstance(node, yaml.ScalarNode)
        low, high = (1, MAX_RUNS) if is_count else (0, SEED_LIMIT)
        for value, line in items:
            if not low <= value <= high:
                fail(line, f'{"the number" if is_count else "each"} of {key} must lie in '
                     f'[{low}, {high}], got {value}')
        if is_count:
            items = [LinedValue(k, items[0].line) for k in range(items[0].value)]
    return _without_repeats(key, items)


def _settings(node: yaml.Node | None) -> dict[str, list[LinedValue]]:
    """Return the values of the settings by field, in the fields' types."""
    if node is None:
        return {}
    settings = {}
    table = read_table(node, 'settings must be a table of fields of the methods')
    for name, (_, values) in table.items():
        items = []
        for value, line in read_values(name, values):
            with _at_line(line):
                items.append(LinedValue(training_runs.setting_value(name, value), line))
        settings[name] = _without_repeats(name, items)
    return settings


def _without_repeats(key: str, items: list[LinedValue]) -> list[LinedValue]:
    """Return the items; fail if a value is there twice."""
    seen = set()
    for value, line in items:
        if value in seen:
            fail(line, f'{key} must differ from each other, got {shown(value)} twice')
        seen.add(value)
    return items


@contextmanager
def _at_line(line: int) -> Iterator[None]:
    """Name the line in the errors of a block."""
    try:
        yield
    except MISTAKES as error:
        fail(line, error)


def _check_values(axes: dict[str, list[LinedValue]]) -> None:
    """Check profiles and maps, policy files against the maps, budgets and advising modes."""
    for profile, line in axes['profile']:
        with _at_line(line):
            config_of(Run(profile=profile))
    worlds = []
    for name, line in axes['map']:
        with _at_line(line):
            worlds += [training_runs.reference_returns_of(Run(map=name, profile=profile)).world
                       for profile, _ in axes['profile']]
    for mentor, line in axes['mentor']:
        with _at_line(line):
            spec = read_mentor_spec(mentor)
            for world in worlds if spec.kind in FROM_FILES else ():
                policy_of_file(spec, world)
    for budget, line in axes['budget']:
        with _at_line(line):
            validate_advice_budget(budget, 'early')
    for advising, line in axes['advising']:
        with _at_line(line):
            validate_advice_budget(0, advising)


def _check_methods(axes: dict[str, list[LinedValue]]) -> None:
    """Check each method in each profile with each combination of the settings."""
    names = [name for name in axes if name not in Run._fields]
    for (profile, _), (method, line) in product(axes['profile'], axes['method']):
        run = Run(profile=profile, method=method)
        with _at_line(line):
            config_of(run)
        for items in product(*(axes[name] for name in names)):
            settings = tuple(zip(names, (value for value, _ in items)))
            try:
                config_of(run._replace(settings=settings))
            except ConfigError as error:
                fail(next(item.line for end, item in enumerate(items, 1)
                          if not _is_valid(run._replace(settings=settings[:end]))), error)


def _is_valid(run: Run) -> bool:
    try:
        return bool(config_of(run))
    except ConfigError:
        return False
