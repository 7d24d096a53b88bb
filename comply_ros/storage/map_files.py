# SPDX-License-Identifier: Apache-2.0
"""Maps from files: those that come with the package, by name, and any other, by path."""

from importlib.resources import files
from pathlib import Path
from typing import Any

from comply_ros.learner.presets import METHODS
from comply_ros.storage.file_system import PathError
from comply_ros.storage.user_files import load_yaml, read_text, shown, YamlError
from comply_ros.world.grid import FREE, Grid, MapError, OBSTACLE

REQUIRED_KEYS = ('intended', 'step_limit', 'rewards', 'starts', 'rows')
KEYS = (*REQUIRED_KEYS, 'profiles', 'slips_bump', 'extends')
REWARDS = ('step', 'obstacle', 'goal')


def map_names() -> list[str]:
    """Names of the maps that come with the package."""
    found = (Path(entry.name) for entry in files('comply_ros').joinpath('maps').iterdir())
    return sorted(entry.stem for entry in found if entry.suffix == '.yaml')


def read_map(name: str, profile: str) -> Grid:
    """
    `Grid` of a map that comes with the package or of a file, with the rewards of a profile.

    Raises
    ------
    MapError: if there is no such map or it breaks a rule; the message names the map.

    """
    try:
        return parse_map(_read_text(name), profile)
    except MapError as error:
        raise MapError(f'map {name!r}: {error}') from None


def _read_text(name: str) -> str:
    if name in map_names():
        return files('comply_ros').joinpath('maps', f'{name}.yaml').read_text(encoding='utf-8')
    try:
        return read_text(name)
    except PathError as error:
        raise MapError(f'a map must be one of {", ".join(map_names())} or a readable file '
                       f'({error})') from None


def parse_map(text: str, profile: str) -> Grid:
    """
    `Grid` of a map's YAML text.

    Raises
    ------
    MapError: naming the rule that is broken and the value.

    """
    table = _parse_table(text)
    for key in table:
        if key not in KEYS:
            raise MapError(f'a map has the keys {", ".join(KEYS)}, got {shown(key)}')
    for key in REQUIRED_KEYS:
        if key not in table:
            raise MapError(f'a map needs the key {key!r}')
    rows = table['rows']
    if not isinstance(rows, list) or not all(isinstance(row, str) for row in rows):
        raise MapError(f"rows must be a list of texts such as '..#G', got {shown(rows)}")
    step, obstacle, goal = _rewards(table, profile)
    slips_bump = table.get('slips_bump', True)
    if type(slips_bump) is not bool:
        raise MapError(f'slips_bump must be true or false, got {shown(slips_bump)}')
    if type(table['step_limit']) is not int:
        raise MapError(f'step_limit must be a whole number, got {shown(table["step_limit"])}')
    return Grid(rows=tuple(rows), starts=_starts(table['starts'], rows),
                step_reward=step, obstacle_reward=obstacle, goal_reward=goal,
                intended=_number(table['intended'], 'intended'),
                step_limit=table['step_limit'], slips_bump=slips_bump)


def _parse_table(text: str) -> dict[Any, Any]:
    """Return the table in a YAML text; keys that it lacks are those of the map that it extends."""
    try:
        table = load_yaml(text).value
    except YamlError as error:
        raise MapError(f'{error.about("a map")} in line {error.line}') from None
    if not isinstance(table, dict):
        raise MapError(f'a map must be a table of {", ".join(REQUIRED_KEYS)}, '
                       f'got {type(table).__name__}')
    name = table.pop('extends', None)
    if name is None:
        return table
    if name not in map_names():
        raise MapError(f'extends must name one of {", ".join(map_names())}, got {shown(name)}')
    return {**_parse_table(_read_text(name)), **table}


def _rewards(table: dict[Any, Any], profile: str) -> list[float]:
    """Return the rewards of step, obstacle and goal in a profile."""
    if profile not in METHODS:
        raise MapError(f'a profile must be one of {", ".join(METHODS)}, got {shown(profile)}')
    profiles = table.get('profiles')
    profiles = {} if profiles is None else profiles
    if not isinstance(profiles, dict) or not set(profiles) <= set(METHODS):
        raise MapError(f'profiles must be a table of {", ".join(METHODS)}, got {shown(profiles)}')
    changes = {name: {} if each is None else _reward_table(each, f'profile {name}')
               for name, each in profiles.items()}
    rewards = {**_reward_table(table['rewards'], 'rewards'), **changes.get(profile, {})}
    if 'obstacle' not in rewards and not any(OBSTACLE in row for row in table['rows']):
        rewards['obstacle'] = rewards.get('step')
    for key in REWARDS:
        if key not in rewards:
            raise MapError(f'rewards need the key {key!r}')
    return [_number(rewards[key], f'reward of {key}') for key in REWARDS]


def _reward_table(rewards: Any, name: str) -> dict[str, Any]:
    if not isinstance(rewards, dict) or not set(rewards) <= set(REWARDS):
        raise MapError(f'{name} must be a table of {", ".join(REWARDS)}, got {shown(rewards)}')
    return rewards


def _starts(starts: Any, rows: list[str]) -> tuple[int, ...]:
    """Return the states of 'anywhere' or of a list of [x, y]."""
    if not rows:
        return ()
    width, height = len(rows[0]), len(rows)
    if starts == 'anywhere':
        return tuple(s for s, cell in enumerate(''.join(reversed(rows))) if cell == FREE)
    if not isinstance(starts, list) or not all(
            isinstance(start, list) and [type(number) for number in start] == [int, int]
            for start in starts):
        raise MapError("starts must be 'anywhere' or a list of [x, y], in whole numbers, "
                       f'got {shown(starts)}')
    for x, y in starts:
        if not (0 <= x < width and 0 <= y < height):
            raise MapError(f'a start must lie in the grid of {width} x {height} cells, '
                           f'got ({x}, {y})')
    return tuple(y * width + x for x, y in starts)


def _number(value: Any, name: str) -> float:
    if type(value) not in (int, float):
        raise MapError(f'{name} must be a number, got {shown(value)}')
    return float(value)
