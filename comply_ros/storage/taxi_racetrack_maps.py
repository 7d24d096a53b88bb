# SPDX-License-Identifier: Apache-2.0
"""Map files with the key `world`: a taxi or a race track on the cells of the map."""

from collections.abc import Callable, Mapping
from typing import Any

from comply_ros.storage.cell_rules_yaml import (
    read_chance,
    read_real,
    read_rows,
    read_table,
    read_walls,
    read_whole,
)
from comply_ros.storage.text_and_yaml_files import shown
from comply_ros.world.grid import check_number, check_rows, check_step_limit, MapError
from comply_ros.world.racetrack import racetrack_table
from comply_ros.world.taxi import taxi_table
from comply_ros.world.transition_table import Table


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


def _rows(table: Mapping[str, Any]) -> tuple[str, ...]:
    rows = read_rows(table)
    check_rows(rows)
    return tuple(rows)


def _taxi(table: Mapping[str, Any]) -> Table:
    rewards = _rewards(table, step=-1.0, deliver=20.0, wrong=-10.0)
    return taxi_table(_rows(table), read_walls(table.get('walls')), rewards['step'],
                      rewards['deliver'], rewards['wrong'], _step_limit(table))


def _racetrack(table: Mapping[str, Any]) -> Table:
    return racetrack_table(
        _rows(table), _rewards(table, step=-1.0)['step'],
        read_chance(table.get('noise', 0.1), 'noise'),
        read_whole(table.get('largest_speed', 4), 'largest_speed'), _step_limit(table))


def _rewards(table: Mapping[str, Any], **defaults: float) -> dict[str, float]:
    given = read_table(table.get('rewards', {}), defaults, 'rewards')
    rewards = {**defaults,
               **{key: read_real(value, f'reward of {key}') for key, value in given.items()}}
    for key, reward in rewards.items():
        check_number(f'reward of {key}', reward)
    return rewards


def _step_limit(table: Mapping[str, Any]) -> int | None:
    if 'step_limit' not in table:
        return None
    limit = read_whole(table['step_limit'], 'step_limit')
    check_step_limit(limit)
    return limit


WORLDS: dict[str, tuple[tuple[str, ...], Callable[[Mapping[str, Any]], Table]]] = {
    'taxi': (('rows', 'walls', 'rewards', 'step_limit'), _taxi),
    'racetrack': (('rows', 'rewards', 'noise', 'largest_speed', 'step_limit'), _racetrack),
}
