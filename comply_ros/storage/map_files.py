# SPDX-License-Identifier: Apache-2.0
"""Maps from files: those that come with the package, by name, and any other, by path."""

from importlib.resources import files
from pathlib import Path

import yaml

from comply_ros.learner.presets import METHODS
from comply_ros.storage.bounded_yaml import (
    BoundedLoader,
    BoundError,
    read_text,
    shown,
    UnreadableError,
)
from comply_ros.world.grid import FREE, Grid, MapError, OBSTACLE

KEYS = ('intended', 'step_limit', 'rewards', 'starts', 'rows')
OPTIONAL = ('profiles', 'slips_bump', 'extends')
REWARDS = ('step', 'obstacle', 'goal')


def map_names():
    """Names of the maps that come with the package."""
    found = (Path(entry.name) for entry in files('comply_ros').joinpath('maps').iterdir())
    return sorted(entry.stem for entry in found if entry.suffix == '.yaml')


def read_map(name, profile):
    """
    `Grid` of a map that comes with the package or of a file, with the rewards of a profile.

    Raises
    ------
    MapError: if there is no such map or it breaks a rule; the message names the map.

    """
    try:
        return parse_map(_text_of(name), profile)
    except MapError as error:
        raise MapError(f'map {name!r}: {error}') from None


def _text_of(name):
    if name in map_names():
        return files('comply_ros').joinpath('maps', f'{name}.yaml').read_text()
    try:
        return read_text(name)
    except UnreadableError as error:
        raise MapError(f'a map must be one of {", ".join(map_names())} or a readable file '
                       f'({error})') from None


def parse_map(text, profile):
    """
    `Grid` of a map's YAML text.

    Raises
    ------
    MapError: naming the rule that is broken and the value.

    """
    content = _extended(_parse_yaml(text))
    _check_keys(content)
    rows = _rows(content['rows'])
    step, obstacle, goal = _rewards(content, profile, rows)
    return Grid(rows=rows, starts=_starts(content['starts'], rows),
                step_reward=step, obstacle_reward=obstacle, goal_reward=goal,
                intended=_number(content['intended'], 'intended'),
                step_limit=_whole(content['step_limit'], 'step_limit'),
                slips_bump=_truth(content.get('slips_bump', True), 'slips_bump'))


def _parse_yaml(text):
    try:
        content = yaml.load(text, BoundedLoader)
    except BoundError as error:
        raise MapError(f'{error.problem} in line {error.problem_mark.line + 1}') from None
    except (yaml.YAMLError, ArithmeticError, ValueError, RecursionError) as error:
        mark = getattr(error, 'problem_mark', None)
        where = f' in line {mark.line + 1}' if mark else ''
        raise MapError(f'a map must be valid YAML, got something else{where}') from None
    if not isinstance(content, dict):
        raise MapError(f'a map must be a table of {", ".join(KEYS)}, '
                       f'got {type(content).__name__}')
    return content


def _extended(content):
    """Return a table with the keys of the map that it extends, where it has none itself."""
    name = content.pop('extends', None)
    if name is None:
        return content
    if name not in map_names():
        raise MapError(f'extends must name one of {", ".join(map_names())}, got {shown(name)}')
    return {**_extended(_parse_yaml(_text_of(name))), **content}


def _check_keys(content):
    for key in content:
        if key not in KEYS + OPTIONAL:
            raise MapError(f'a map has the keys {", ".join(KEYS + OPTIONAL)}, got {shown(key)}')
    for key in KEYS:
        if key not in content:
            raise MapError(f'a map needs the key {key!r}')


def _rows(rows):
    if not isinstance(rows, list) or not all(isinstance(row, str) for row in rows):
        raise MapError(f"rows must be a list of texts such as '..#G', got {shown(rows)}")
    return tuple(rows)


def _rewards(content, profile, rows):
    if profile not in METHODS:
        raise MapError(f'a profile must be one of {", ".join(METHODS)}, got {shown(profile)}')
    rewards = {**_table(content['rewards'], 'rewards'),
               **_profiles(content.get('profiles')).get(profile, {})}
    if 'obstacle' not in rewards and not any(OBSTACLE in row for row in rows):
        rewards['obstacle'] = rewards.get('step')
    for key in REWARDS:
        if key not in rewards:
            raise MapError(f'rewards need the key {key!r}')
    return [_number(rewards[key], f'reward of {key}') for key in REWARDS]


def _profiles(profiles):
    """Return the changes of rewards of each profile, empty ones as tables."""
    profiles = {} if profiles is None else profiles
    if not isinstance(profiles, dict) or not set(profiles) <= set(METHODS):
        raise MapError(f'profiles must be a table of {", ".join(METHODS)}, got {shown(profiles)}')
    return {name: {} if changes is None else _table(changes, f'profile {name}')
            for name, changes in profiles.items()}


def _table(rewards, name):
    if not isinstance(rewards, dict) or not set(rewards) <= set(REWARDS):
        raise MapError(f'{name} must be a table of {", ".join(REWARDS)}, got {shown(rewards)}')
    return rewards


def _starts(starts, rows):
    if not rows:
        return ()
    width, height = len(rows[0]), len(rows)
    if starts == 'anywhere':
        return tuple(s for s, cell in enumerate(''.join(reversed(rows))) if cell == FREE)
    if not isinstance(starts, list) or not all(_is_a_place(start) for start in starts):
        raise MapError("starts must be 'anywhere' or a list of [x, y], in whole numbers, "
                       f'got {shown(starts)}')
    for x, y in starts:
        if not (0 <= x < width and 0 <= y < height):
            raise MapError(f'a start must lie in the grid of {width} x {height} cells, '
                           f'got ({x}, {y})')
    return tuple(y * width + x for x, y in starts)


def _is_a_place(start):
    return isinstance(start, list) and len(start) == 2 and all(type(n) is int for n in start)


def _number(value, name):
    if type(value) not in (int, float):
        raise MapError(f'{name} must be a number, got {shown(value)}')
    return float(value)


def _truth(value, name):
    if type(value) is not bool:
        raise MapError(f'{name} must be true or false, got {shown(value)}')
    return value


def _whole(value, name):
    if type(value) is not int:
        raise MapError(f'{name} must be a whole number, got {shown(value)}')
    return value
