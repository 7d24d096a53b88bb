# SPDX-License-Identifier: Apache-2.0
"""Map files, and the maps of this package by their names: read, and checked."""

from importlib.resources import files
from pathlib import Path
from typing import Any

from comply_ros.learner.presets import METHODS
from comply_ros.numerics.number_text import NumberError, read_integer, read_number
from comply_ros.storage.cell_rules_yaml import (
    CELL_KEYS,
    marked_starts,
    needs_cell_rules,
    parse_cell_rules,
    read_chance,
    read_flag,
    read_real,
    read_rows,
    read_table,
    read_whole,
)
from comply_ros.storage.file_system import PathError
from comply_ros.storage.gymnasium_world import EnvironmentWorld, read_environment_name
from comply_ros.storage.map_name import GARNET, GYM, map_names, NAV2, parse_map_name
from comply_ros.storage.nav2_maps import nav2_rows, nav2_state, read_nav2_map, read_points
from comply_ros.storage.taxi_racetrack_maps import named_world
from comply_ros.storage.text_and_yaml_files import load_yaml, read_text, shown, YamlError
from comply_ros.world.cell_rules import OTHER, RIGHT_ANGLES
from comply_ros.world.cell_rules_table import table_of
from comply_ros.world.garnet import garnet_table
from comply_ros.world.grid import default_step_limit, FREE, Grid, MapError, OBSTACLE
from comply_ros.world.mdp import Source
from comply_ros.world.state_action_spaces import Spaces
from comply_ros.world.transition_table import Table

REQUIRED_KEYS = ('rewards', 'starts', 'rows')
OPTIONAL_KEYS = ('intended', 'step_limit', 'profiles', 'slips_bump', 'extends')
NAV2_KEYS = ('nav2', 'goals')
KEYS = (*REQUIRED_KEYS, *OPTIONAL_KEYS, *CELL_KEYS, *NAV2_KEYS, 'world')
REWARDS = ('step', 'obstacle', 'goal', 'edge', 'wall')
NAV2_REWARDS = {'step': -0.1, 'obstacle': -5.0, 'goal': 10.0}  # of a map that is only a path
NAV2_ARGUMENTS = ('start', 'goal', 'cell_size')
CELL_SIZE = 0.5  # metres, of a map of Nav2


def read_map(name: str, profile: str) -> Grid | Table:
    """
    World of a map as `read_world`, of which is known what every action leads to.

    Raises
    ------
    MapError: also for an environment of Gymnasium without a table of its transitions.

    """
    world = read_world(name, profile)
    if isinstance(world, Spaces):
        raise MapError(f'map {name!r}: this environment has no table of its transitions (P), so '
                       'only train, lesson, sweep and the node gym_world take it')
    return world


def read_world(name: str, profile: str) -> Source:
    """
    World of a map that comes with the package, of a file, or of another library.

    A map that needs no more than a `Grid` has is one, an environment of Gymnasium without a table
    of its transitions is `Spaces`; any other is a `Table`.

    Parameters
    ----------
    name: of a map of the package, path of a map file, `gym:` and the name of an environment of
        Gymnasium, `nav2:` and the path of a map of Nav2, or `garnet:` and a seed; see `MapName`.
    profile: as in `parse_map`; worlds of others have their own rewards in every profile.

    Raises
    ------
    MapError: if there is no such map or it breaks a rule; the message names the map.

    """
    try:
        scheme, target, arguments = parse_map_name(str(name))
        if scheme == NAV2:
            return _nav2_world(target, arguments, profile)
        _check_profile(profile)
        if scheme == GYM:
            return _environment_source(target, arguments)
        if scheme == GARNET:
            return _garnet(target, arguments)
        return parse_map(_read_text(name), profile, Path(name).parent)
    except MapError as error:
        raise MapError(f'map {name!r}: {error}') from None


def _environment_source(target: str, arguments: dict[str, Any]) -> Table | Spaces:
    world = EnvironmentWorld(read_environment_name(target, arguments), requires_table=True)
    world.close()
    return world.source


def _garnet(seed: str, arguments: dict[str, Any]) -> Table:
    try:
        if arguments:
            raise MapError('a Garnet has no arguments, got ' + shown(next(iter(arguments))))
        return garnet_table(read_integer(seed))
    except NumberError:
        raise MapError('a Garnet must be named garnet:SEED, with a whole number, got '
                       + shown(seed)) from None


def _read_text(name: str) -> str:
    if name in map_names():
        return files('comply_ros').joinpath('maps', f'{name}.yaml').read_text(encoding='utf-8')
    try:
        return read_text(name)
    except PathError as error:
        raise MapError(f'a map must be one of {", ".join(map_names())}, gym:NAME, nav2:FILE, '
                       f'garnet:SEED or a readable file ({error})') from None


def _nav2_world(path: str, arguments: dict[str, Any], profile: str) -> Grid | Table:
    for key in arguments:
        if key not in NAV2_ARGUMENTS:
            raise MapError(f'a map of Nav2 has the arguments {", ".join(NAV2_ARGUMENTS)}, got '
                           + shown(key))
    for key in ('start', 'goal'):
        if key not in arguments:
            raise MapError(f'a map of Nav2 needs a {key} in metres, such as nav2:house.yaml?'
                           'start=-2.0,-0.5&goal=3.0,1.0, got none')
    return _world({'nav2': path, 'cell_size': arguments.get('cell_size', CELL_SIZE),
                   'starts': [_point(arguments['start'])], 'goals': [_point(arguments['goal'])],
                   'rewards': NAV2_REWARDS, 'edges': 'bump'}, profile, Path())


def _point(value: Any) -> Any:
    """Return [x, y] of the text `x,y`; any other value as it is."""
    try:
        return [read_number(word) for word in value.split(',')]
    except (AttributeError, NumberError):
        return value


def parse_map(text: str, profile: str, folder: Path = Path()) -> Grid | Table:
    """
    World of a map's YAML text, as in `read_map`.

    folder: of the file, from which a map of Nav2 is looked for.

    Raises
    ------
    MapError: naming the rule that is broken and the value.

    """
    return _world(_parse_table(text), profile, folder)


def _check_profile(profile: str) -> None:
    if profile not in METHODS:
        raise MapError(f'a profile must be one of {", ".join(METHODS)}, got {shown(profile)}')


def _world(table: dict[Any, Any], profile: str, folder: Path) -> Grid | Table:
    _check_profile(profile)
    if 'world' in table:
        return named_world(table)
    if 'image' in table and 'rows' not in table:
        raise MapError('a map of Nav2 needs a start and a goal: name it as nav2:FILE?start=X,Y&'
                       'goal=X,Y, or in the key nav2 of a map file, got only its own keys')
    for key in table:
        if key not in KEYS:
            raise MapError(f'a map has the keys {", ".join(KEYS)}, got {shown(key)}')
    _check_slips(table)
    if 'nav2' in table:
        return _nav2_table(table, profile, folder)
    if 'goals' in table:
        raise MapError('goals must be cells G of the rows; the key is for a map with nav2')
    if needs_cell_rules(table):
        return _cell_table(table, profile)
    for key in REQUIRED_KEYS:
        if key not in table:
            raise MapError(f'a map needs the key {key!r}')
    rows = read_rows(table)
    rewards = _rewards(table, profile)
    if {'edge', 'wall'} & set(rewards) or any(
            rewards.get(key, -1.0) >= 0 for key in ('step', 'obstacle')):
        return _cell_table(table, profile)
    step, obstacle, goal = _grid_rewards(rewards, rows)
    slips_bump = read_flag(table, 'slips_bump', True)
    limit = default_step_limit(sum(map(len, rows)))
    return Grid(rows=tuple(rows), starts=_starts(table['starts'], rows),
                step_reward=step, obstacle_reward=obstacle, goal_reward=goal,
                intended=read_chance(table.get('intended', 1.0), 'intended'),
                step_limit=read_whole(table.get('step_limit', limit), 'step_limit'),
                slips_bump=slips_bump)


def _check_slips(table: dict[Any, Any]) -> None:
    """Return if the kind of slips has a meaning; values that it cannot have are left to others."""
    if 'intended' in table:
        return
    for key, is_valid in (('slips', table.get('slips') in (OTHER, RIGHT_ANGLES)),
                          ('slips_bump', isinstance(table.get('slips_bump'), bool))):
        if is_valid:
            raise MapError(f'a map with {key}: {str(table[key]).lower()} needs the key intended, '
                           'the chance that a move does not slip')


def _cell_table(table: dict[Any, Any], profile: str) -> Table:
    """Return the world of a map with keys or cells that a `Grid` does not have."""
    for key in ('rewards', 'rows'):
        if key not in table:
            raise MapError(f'a map needs the key {key!r}')
    rows = read_rows(table)
    marked = marked_starts(rows)
    if ('starts' in table) == bool(marked):
        raise MapError('starts must be given either by the key or by cells S, got '
                       + ('both' if marked else 'none'))
    starts = marked or _starts(table['starts'], rows)
    return table_of(parse_cell_rules(table, _rewards(table, profile), starts))


def _nav2_table(table: dict[Any, Any], profile: str, folder: Path) -> Table:
    """Return the world of a map of Nav2, with starts and goals in metres."""
    for key in ('rewards', 'starts', 'goals'):
        if key not in table:
            raise MapError(f'a map with nav2 needs the key {key!r}')
    if 'rows' in table:
        raise MapError('a map needs either nav2 or rows, got both')
    if not isinstance(table['nav2'], str):
        raise MapError(f'nav2 must be the path of a map of Nav2, got {shown(table["nav2"])}')
    nav2 = read_nav2_map(table['nav2'], folder)
    cell_size = read_real(table.get('cell_size', CELL_SIZE), 'cell_size')
    rows = nav2_rows(nav2, cell_size, read_points(table['goals'], 'goals'))
    starts = tuple(nav2_state(nav2, cell_size, point, 'start')
                   for point in read_points(table['starts'], 'starts'))
    return table_of(parse_cell_rules({**table, 'rows': rows, 'cell_size': cell_size},
                                     _rewards(table, profile), starts, nav2.origin))


def _parse_table(text: str) -> dict[Any, Any]:
    """Return the table in a YAML text; keys that it lacks are those of the map that it extends."""
    try:
        table = load_yaml(text).value
    except YamlError as error:
        raise MapError(f'{error.about("a map")} in line {error.line}') from None
    if not isinstance(table, dict):
        raise MapError(f'a map must be a table of {", ".join(REQUIRED_KEYS)}, '
                       f'got {"nothing" if table is None else type(table).__name__}')
    name = table.pop('extends', None)
    if name is None:
        return table
    if name not in map_names():
        raise MapError(f'extends must name one of {", ".join(map_names())}, got {shown(name)}')
    return {**_parse_table(_read_text(name)), **table}


def _rewards(table: dict[Any, Any], profile: str) -> dict[str, float]:
    """Return the rewards that a map gives in a profile, by their keys."""
    profiles = table.get('profiles')
    profiles = read_table({} if profiles is None else profiles, METHODS, 'profiles')
    changes = {name: {} if each is None else read_table(each, REWARDS, f'profile {name}')
               for name, each in profiles.items()}
    rewards = {**read_table(table['rewards'], REWARDS, 'rewards'), **changes.get(profile, {})}
    return {key: read_real(value, f'reward of {key}') for key, value in rewards.items()}


def _grid_rewards(rewards: dict[str, float], rows: list[str]) -> list[float]:
    """Return the rewards of step, obstacle and goal; without obstacles, theirs can be missing."""
    if 'obstacle' not in rewards and 'step' in rewards \
            and not any(OBSTACLE in row for row in rows):
        rewards = {**rewards, 'obstacle': rewards['step']}
    for key in ('step', 'obstacle', 'goal'):
        if key not in rewards:
            raise MapError(f'rewards need the key {key!r}')
    return [rewards[key] for key in ('step', 'obstacle', 'goal')]


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
