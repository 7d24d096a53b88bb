# SPDX-License-Identifier: Apache-2.0
"""Map files with the key `world`: a taxi or a race track on the cells of the map."""

from collections.abc import Callable, Mapping
from typing import Any

from comply_ros.storage.cell_keys import read_chance, read_real, read_walls, read_whole
from comply_ros.storage.user_files import shown
from comply_ros.world.grid import LARGEST_REWARD, MapError
from comply_ros.world.racetrack import racetrack_table
from comply_ros.world.table import Table
from comply_ros.world.taxi import taxi_table


def named_world(table: Mapping[str, Any]) -> Table:
    """
    `Table` of a map with the key `world`.

    Raises
    ------
    MapError: naming the rule that is broken and the value.

    """
    name = table['world']
    if not isinstance(name, str) or name not in WORLDS:
        raise MapError(f'world must be one of {", ".join(WORLDS)}, got {shown(name)}')
    keys, build = WORLDS[name]
    for key in table:
        if key not in ('world', *keys):
            raise MapError(f'a map of world {name} has the keys world, {", ".join(keys)}, '
                           f'got {shown(key)}')
    return build(table)


def read_rows(table: Mapping[str, Any]) -> tuple[str, ...]:
    """
    Return the rows of a map, which are of the same length.

    Raises
    ------
    MapError: if there are none, or they are something else.

    """
    rows = table.get('rows')
    if not isinstance(rows, list) or not all(isinstance(row, str) for row in rows):
        raise MapError(f"rows must be a list of texts such as '..#G', got {shown(rows)}")
    if not rows or not rows[0]:
        raise MapError('a map needs at least one row of cells, got none')
    for number, row in enumerate(rows, 1):
        if len(row) != len(rows[0]):
            raise MapError('all rows must have the same length: '
                           f'row {number} has {len(row)} cells, row 1 has {len(rows[0])}')
    return tuple(rows)


def _taxi(table: Mapping[str, Any]) -> Table:
    rewards = _rewards(table, step=-1.0, deliver=20.0, wrong=-10.0)
    return taxi_table(read_rows(table), read_walls(table.get('walls')), rewards['step'],
                      rewards['deliver'], rewards['wrong'], _step_limit(table))


def _racetrack(table: Mapping[str, Any]) -> Table:
    return racetrack_table(
        read_rows(table), _rewards(table, step=-1.0)['step'],
        read_chance(table.get('noise', 0.1), 'noise'),
        read_whole(table.get('largest_speed', 4), 'largest_speed'), _step_limit(table))


def _rewards(table: Mapping[str, Any], **defaults: float) -> dict[str, float]:
    given = table.get('rewards', {})
    if not isinstance(given, dict) or not set(given) <= set(defaults):
        raise MapError(f'rewards must be a table of {", ".join(defaults)}, got {shown(given)}')
    rewards = {**defaults,
               **{key: read_real(value, f'reward of {key}') for key, value in given.items()}}
    for key, reward in rewards.items():
        if not abs(reward) <= LARGEST_REWARD:
            raise MapError(f'reward of {key} must be a finite number of at most '
                           f'{LARGEST_REWARD:.0f}, got {reward}')
    return rewards


def _step_limit(table: Mapping[str, Any]) -> int | None:
    if 'step_limit' not in table:
        return None
    limit = read_whole(table['step_limit'], 'step_limit')
    if not 1 <= limit <= 1_000_000:
        raise MapError(f'step_limit must lie in [1, 1000000], got {limit}')
    return limit


WORLDS: dict[str, tuple[tuple[str, ...], Callable[[Mapping[str, Any]], Table]]] = {
    'taxi': (('rows', 'walls', 'rewards', 'step_limit'), _taxi),
    'racetrack': (('rows', 'rewards', 'noise', 'largest_speed', 'step_limit'), _racetrack),
}
