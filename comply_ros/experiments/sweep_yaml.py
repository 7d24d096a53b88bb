# SPDX-License-Identifier: Apache-2.0
"""The file of a sweep: methods x mentors x settings x seeds, and every way it can be wrong."""

from contextlib import contextmanager
from itertools import product
from math import prod

import yaml

from comply_ros.experiments.sweep_grid import Sweep
from comply_ros.experiments.training_runs import row_of, Run, yardstick_of
from comply_ros.experiments.yaml_lines import (
    compose,
    Item,
    items_of,
    SweepFileError,
    table_of,
    wrong,
)
from comply_ros.learner.learner_config import ConfigError, LearnerConfig, with_text
from comply_ros.mentor.advice_budget import validate_advice_budget
from comply_ros.mentor.mentor_policies import MentorError
from comply_ros.mentor.policy_text import parse_policy, PolicyError
from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.storage.bounded_yaml import read_text, shown
from comply_ros.storage.file_system import PathError
from comply_ros.storage.mentor_cache import read_mentor_spec
from comply_ros.world.grid import MapError
from comply_ros.world.planning import PlanningError

AXES = {  # key of the file: field of `Run`, and the type of its values; what varies first is last
    'map': ('map', str), 'profile': ('profile', str), 'mentors': ('mentor', str),
    'mentor_seeds': ('mentor_seed', int), 'budgets': ('budget', int),
    'advising': ('advising', str), 'methods': ('method', str), 'settings': None,
    'seeds': ('seed', int)}
NEEDED = ('methods', 'mentors', 'seeds')
COUNTS = ('seeds', 'mentor_seeds')  # where a number alone is how many
MOST_RUNS = 1_000_000


def read_sweep(path):
    """
    `Sweep` of a file; every value in it is checked now, its mentors are not generated.

    Raises
    ------
    SweepFileError: naming the file, the line, the rule that is broken and the value.

    """
    try:
        return parse_sweep(read_text(path))
    except PathError as error:
        raise SweepFileError(
            f'a sweep file must be readable, got {str(path)!r} ({error})') from None
    except SweepFileError as mistake:
        raise SweepFileError(f'{path}, {mistake}') from None


def parse_sweep(text):
    """
    `Sweep` of a file's YAML text.

    Raises
    ------
    SweepFileError: naming the line, the rule that is broken and the value.

    """
    nodes = _nodes(text)
    axes = {}
    for key, kind in AXES.items():
        axes.update(_settings(nodes.get(key)) if kind is None else
                    {kind[0]: _axis(key, kind[1], nodes.get(key), getattr(Run(), kind[0]))})
    runs = prod(map(len, axes.values()))
    if runs > MOST_RUNS:
        wrong(axes['seed'][0].line, f'a sweep may have at most {MOST_RUNS} runs, got {runs}')
    sweep = Sweep({name: tuple(item.value for item in items) for name, items in axes.items()})
    _check_worlds(axes)
    _check_advising(axes)
    _check_methods(axes, sweep.settings)
    return sweep


@contextmanager
def _line(number):
    """Name the line in the mistakes of a block."""
    try:
        yield
    except (MapError, MentorError, ConfigError, PlanningError, PolicyError) as mistake:
        wrong(number, mistake)


def _nodes(text):
    """Return the YAML nodes of a file's keys, as a table."""
    root = compose(text)
    nodes = table_of(root, f'a sweep must be a table of {", ".join(AXES)}')
    for key, (line, _) in nodes.items():
        if key not in AXES:
            wrong(line, f'a sweep has the keys {", ".join(AXES)}, got {shown(key)}')
    for key in NEEDED:
        if key not in nodes:
            wrong(root.start_mark.line + 1, f'a sweep needs the key {key!r}')
    return {key: node for key, (_, node) in nodes.items()}


def _axis(key, kind, node, default):
    """`Item` of each value of a key, checked for their type; of the default without a node."""
    if node is None:
        return [Item(default, 1)]
    items = items_of(key, node)
    for item in items:
        if type(item.value) is not kind:
            wrong(item.line, f'{key} must be {"words" if kind is str else "whole numbers"}, '
                  f'got {shown(item.value)}')
    if key in COUNTS:
        items = _seeds(key, items, is_count=isinstance(node, yaml.ScalarNode))
    return _different(key, items)


def _seeds(key, items, is_count):
    low, high = (1, MOST_RUNS) if is_count else (0, SEED_LIMIT)
    for value, line in items:
        if not low <= value <= high:
            wrong(line, f'{"the number" if is_count else "each"} of {key} must lie in '
                  f'[{low}, {high}], got {value}')
    return [Item(k, items[0].line) for k in range(items[0].value)] if is_count else items


def _different(key, items):
    seen = set()
    for value, line in items:
        if value in seen:
            wrong(line, f'{key} must differ from each other, got {shown(value)} twice')
        seen.add(value)
    return items


def _settings(node):
    """`{field: [Item]}` of the settings, in the types of the fields."""
    if node is None:
        return {}
    fields = table_of(node, 'settings must be a table of fields of the methods')
    return {name: _different(name, [_typed(name, item) for item in items_of(name, each)])
            for name, (_, each) in fields.items()}


def _typed(name, item):
    with _line(item.line):
        return item._replace(value=getattr(with_text(LearnerConfig(), name, str(item.value)), name))


def _check_worlds(axes):
    """Check profiles and maps, and policy files against the maps."""
    for profile in axes['profile']:
        with _line(profile.line):
            row_of(Run(profile=profile.value))
    worlds = []
    for name in axes['map']:
        with _line(name.line):
            worlds += [yardstick_of(Run(map=name.value, profile=profile.value)).world
                       for profile in axes['profile']]
    for mentor in axes['mentor']:
        with _line(mentor.line):
            spec = read_mentor_spec(mentor.value)
            for world in worlds if spec.kind == 'file' else ():
                parse_policy(spec.value, world)


def _check_advising(axes):
    for budget in axes['budget']:
        with _line(budget.line):
            validate_advice_budget(budget.value, 'early')
    for when in axes['advising']:
        with _line(when.line):
            validate_advice_budget(0, when.value)


def _check_methods(axes, settings):
    """Check each method in each profile with each combination of the settings."""
    for profile in axes['profile']:
        for method in axes['method']:
            run = Run(profile=profile.value, method=method.value)
            with _line(method.line):
                row_of(run)
            _check_settings(run, settings, [axes[name] for name in settings])


def _check_settings(run, names, columns):
    """Check a run with every combination of the settings; the line is of the one that breaks."""
    for chosen in product(*columns):
        settings = tuple((name, item.value) for name, item in zip(names, chosen))
        try:
            row_of(run._replace(settings=settings))
        except ConfigError as mistake:
            wrong(chosen[_breaking(run, settings)].line, mistake)


def _breaking(run, settings):
    """Return the place of the setting with which those before it, too, cannot be; or the last."""
    for place in range(len(settings) - 1):
        try:
            row_of(run._replace(settings=settings[:place + 1]))
        except ConfigError:
            return place
    return len(settings) - 1
