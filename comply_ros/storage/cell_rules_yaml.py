# SPDX-License-Identifier: Apache-2.0
"""The keys of a map that a `Grid` does not have: read, checked for their types, as `CellRules`."""

from collections.abc import Callable, Collection, Mapping
from typing import Any

from comply_ros.storage.text_and_yaml_files import shown
from comply_ros.world.cell_rules import BUILT_IN, CellRules, Letter, START, TO_START
from comply_ros.world.grid import CELLS, GOAL, MapError
from comply_ros.world.wind import Wind

CELL_KEYS = ('legend', 'moves', 'stay', 'edges', 'slips', 'walls', 'wind', 'continuing',
             'cell_size')
LETTER_KEYS = ('reward', 'ends', 'to', 'when')
WIND_KEYS = ('columns', 'rows', 'chance', 'gusts')
WHEN = ('enter', 'leave')
EDGES = ('absent', 'bump')


def parse_cell_rules(table: Mapping[str, Any], rewards: Mapping[str, float],
                     starts: tuple[int, ...],
                     origin: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> CellRules:
    """
    `CellRules` of a map.

    table: the keys of the map; `rows` is a list of texts. rewards: of step, obstacle, goal, edge
    and wall, those that the map gives. starts: the states in which an episode can start. origin:
    as in `CellRules`.

    Raises
    ------
    MapError: naming the rule that is broken and the value.

    """
    legend = _legend(table.get('legend'))
    has_goal = any(GOAL in row for row in table['rows'])
    if has_goal and GOAL not in legend:
        legend[GOAL] = Letter(_needed(rewards, 'goal'), ends=True)
    step = _needed(rewards, 'step')
    slips, limit = table.get('slips', 'other'), table.get('step_limit')
    return CellRules(
        rows=tuple(table['rows']), starts=starts, legend=legend, step_reward=step,
        obstacle_reward=rewards.get('obstacle', step), edge_reward=rewards.get('edge', step),
        wall_reward=rewards.get('wall', step),
        intended=read_chance(table.get('intended', 1), 'intended'),
        slips=_chances(slips, 'slips') if not isinstance(slips, str) else slips,
        slips_bump=read_flag(table, 'slips_bump', True), moves=_moves(table.get('moves', 4)),
        stay=read_flag(table, 'stay', False), edges_bump=_edges(table.get('edges', 'absent')),
        walls=read_walls(table.get('walls')), wind=_wind(table.get('wind')),
        step_limit=read_whole(limit, 'step_limit') if 'step_limit' in table else None,
        continuing=read_flag(table, 'continuing', False),
        cell_size=read_real(table.get('cell_size', 1), 'cell_size'), origin=origin)


def needs_cell_rules(table: Mapping[str, Any]) -> bool:
    """Whether a map has a key or a cell that a `Grid` does not have."""
    rows = table.get('rows')
    texts = [row for row in rows if isinstance(row, str)] if isinstance(rows, list) else []
    return any(key in table for key in CELL_KEYS) or not set().union(*texts) <= set(CELLS)


def marked_starts(rows: list[str]) -> tuple[int, ...]:
    """Return the states whose cell is S."""
    return tuple(s for s, cell in enumerate(''.join(reversed(rows))) if cell == START)


def _needed(rewards: Mapping[str, float], key: str) -> float:
    if key not in rewards:
        raise MapError(f'rewards need the key {key!r}')
    return rewards[key]


def _legend(legend: Any) -> dict[str, Letter]:
    if legend is None:
        return {}
    if not isinstance(legend, dict):
        raise MapError('legend must be a table of letters, such as H: {reward: -1, ends: true}, '
                       f'got {shown(legend)}')
    return {str(letter): _letter(str(letter), meaning) for letter, meaning in legend.items()}


def _letter(letter: str, meaning: Any) -> Letter:
    if letter in BUILT_IN:
        raise MapError(f'a letter of the legend must be one character other than '
                       f'{" ".join(BUILT_IN)}, got {letter!r}')
    meaning = read_table(meaning, LETTER_KEYS, f'{shown(letter)} of the legend')
    reward = meaning.get('reward')
    when = meaning.get('when', WHEN[0])
    if when not in WHEN:
        raise MapError(f'when of {letter!r} must be {" or ".join(WHEN)}, got {shown(when)}')
    return Letter(None if reward is None else read_real(reward, f'reward of {letter!r}'),
                  read_flag(meaning, 'ends', False), _target(letter, meaning.get('to')),
                  when == WHEN[1])


def _target(letter: str, to: Any) -> tuple[int, int] | str | None:
    if to is None or to == TO_START:
        return to
    if not isinstance(to, list) or [type(number) for number in to] != [int, int]:
        raise MapError(f'to of {letter!r} must be {TO_START} or [x, y], in whole numbers, '
                       f'got {shown(to)}')
    return to[0], to[1]


def _moves(moves: Any) -> int:
    if type(moves) is not int:
        raise MapError(f'moves must be 4 or 8, got {shown(moves)}')
    return moves


def _edges(edges: Any) -> bool:
    if edges not in EDGES:
        raise MapError(f'edges must be {" or ".join(EDGES)}, got {shown(edges)}')
    return edges == 'bump'


def read_rows(table: Mapping[str, Any]) -> list[str]:
    """
    Rows of a map, as texts.

    Raises
    ------
    MapError: if they are something else.

    """
    rows = table.get('rows')
    if not isinstance(rows, list) or not all(isinstance(row, str) for row in rows):
        raise MapError(f"rows must be a list of texts such as '..#G', got {shown(rows)}")
    return rows


def read_walls(walls: Any) -> tuple[tuple[int, int, int, int], ...]:
    """
    Walls as (x, y, x2, y2) of their corners.

    Raises
    ------
    MapError: if they are not a list of [[x, y], [x2, y2]].

    """
    if walls is None:
        return ()
    if not isinstance(walls, list):
        raise MapError(f'walls must be a list of [[x, y], [x, y]], got {shown(walls)}')
    for wall in walls:
        if not (isinstance(wall, list) and len(wall) == 2 and all(
                isinstance(corner, list) and [type(number) for number in corner] == [int, int]
                for corner in wall)):
            raise MapError('a wall must go from corner to corner, [[x, y], [x, y]] in whole '
                           f'numbers, got {shown(wall)}')
    return tuple((*one, *other) for one, other in walls)


def _wind(wind: Any) -> Wind | None:
    if wind is None:
        return None
    wind = read_table(wind, WIND_KEYS, 'wind')
    gusts = _chances(wind.get('gusts', {}), 'gusts')
    for change in gusts:
        if type(change) is not int:
            raise MapError('gusts must be chances of changes in whole cells, such as 1: 0.3, '
                           f'got {shown(change)}')
    return Wind(_strengths(wind.get('columns'), 'columns'), _strengths(wind.get('rows'), 'rows'),
                read_chance(wind.get('chance', 1), 'the chance of wind'), gusts)


def _strengths(numbers: Any, name: str) -> tuple[int, ...] | None:
    if numbers is None:
        return None
    if not isinstance(numbers, list) or not all(type(number) is int for number in numbers):
        raise MapError(f'wind of {name} must be a list of whole numbers, got {shown(numbers)}')
    return tuple(numbers)


def _chances(table: Any, name: str) -> dict[Any, float]:
    if not isinstance(table, dict):
        raise MapError(f'{name} must be a table of chances, got {shown(table)}')
    return {key: read_chance(chance, f'a chance of {name}') for key, chance in table.items()}


def read_table(value: Any, keys: Collection[str], name: str) -> dict[Any, Any]:
    """
    Value of a key that is a table, with some of these keys.

    Raises
    ------
    MapError: if it is something else, or has another key, which the message names.

    """
    if not isinstance(value, dict):
        raise MapError(f'{name} must be a table of {", ".join(keys)}, got {shown(value)}')
    for key in value:
        if key not in keys:
            raise MapError(f'{name} must be a table of {", ".join(keys)}, got the key '
                           f'{shown(key)}')
    return value


def read_flag(table: Mapping[str, Any], key: str, default: bool) -> bool:
    """
    Value of a key that is true or false.

    Raises
    ------
    MapError: if it is something else.

    """
    return _of_type(bool, table.get(key, default), key, 'true or false')


def read_whole(value: Any, name: str) -> int:
    """
    Value of a key that is a whole number.

    Raises
    ------
    MapError: if it is something else.

    """
    return _of_type(int, value, name, 'a whole number')


def read_real(value: Any, name: str) -> float:
    """
    Value of a key that is a number.

    Raises
    ------
    MapError: if it is something else.

    """
    return float(_of_type(float, value, name, 'a number') if type(value) is not int else value)


def read_chance(value: Any, name: str) -> float:
    """
    Value of a key that is a probability: a number, or a fraction such as 1/3.

    Raises
    ------
    MapError: if it is something else; the range is not checked.

    """
    if isinstance(value, str) and value.count('/') == 1:
        above, below = (part.strip() for part in value.split('/'))
        if above.isdecimal() and below.isdecimal() and below.isascii() and len(value) < 20 \
                and int(below):
            return int(above) / int(below)
    return read_real(value, name)


def _of_type(kind: Callable[[Any], Any], value: Any, name: str, rule: str) -> Any:
    if type(value) is not kind:
        raise MapError(f'{name} must be {rule}, got {shown(value)}')
    return value
