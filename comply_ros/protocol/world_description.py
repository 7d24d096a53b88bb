# SPDX-License-Identifier: Apache-2.0
"""`WorldDescription`: made from a world, made into one, and checked; and as part of a state."""

from __future__ import annotations

from array import array
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from comply_ros.protocol.messages import (
    GridModel,
    LONGEST_NAME,
    NO_RUN,
    PROTOCOL,
    TableModel,
    WorldDescription,
)
from comply_ros.world.grid import ACTION_NAMES, Grid
from comply_ros.world.mdp import Source
from comply_ros.world.state_action_spaces import Spaces, validate_action_names
from comply_ros.world.transition_table import MOST_STATES, Table

NONE, GRID, TABLE = range(3)
MODELS = 'NONE', 'GRID', 'TABLE'
LARGEST_DESCRIPTION = 64 * 2 ** 20  # bytes as a message


def describe_world(source: Source, name: str, run: int, began: int = 0) -> WorldDescription:
    """Return the description of a world; began: nanoseconds since 1970, for people to read."""
    states, actions, starts = _spaces_of(source)
    description = WorldDescription(
        PROTOCOL, run, NO_RUN, began, name, states, actions, starts, source.step_limit, NONE,
        GridModel(), TableModel(), (), array('d'), (), source.sha256)
    if isinstance(source, Grid):
        return description._replace(model=GRID, grid=GridModel(
            source.rows, source.step_reward, source.obstacle_reward, source.goal_reward,
            source.intended, source.slips_bump))
    if isinstance(source, Spaces):
        return description if source.available is None else description._replace(
            available=tuple(source.available.ravel().tolist()))
    return description._replace(
        model=TABLE,
        table=TableModel(_packed('I', source.first), _packed('I', source.successor),
                         _packed('d', source.probability), _packed('d', source.reward),
                         _packed('I', np.flatnonzero(source.terminal))),
        positions=array('d') if source.positions is None else _packed('d', source.positions),
        cells=source.cells or ())


def world_from_description(msg: WorldDescription) -> Source:
    """
    Return the world that a message describes.

    Raises
    ------
    ValueError: if the message is of another protocol, breaks a rule of the world, or gives a hash
        that is not that of the world.

    """
    if msg.protocol != PROTOCOL:
        raise ValueError(f'its messages must have protocol {PROTOCOL}, as those of this version '
                         f'of comply_ros, got protocol {msg.protocol}: run nodes of one version')
    if len(msg.name) > LONGEST_NAME:
        raise ValueError(f'a name must have at most {LONGEST_NAME} characters, '
                         f'got {len(msg.name)}')
    if msg.model not in range(len(MODELS)):
        raise ValueError('model must be ' + ', '.join(
            f'{number} {name}' for number, name in enumerate(MODELS)) + f', got {msg.model}')
    _check_unused(msg)
    if not 1 <= msg.states <= MOST_STATES:
        raise ValueError(f'a world must have 1 to {MOST_STATES} states, got {msg.states}')
    validate_action_names(msg.actions)
    source = (_spaces, _grid, _table)[msg.model](msg)
    if not isinstance(source, Grid) and msg.sha256 not in ('', source.sha256):
        raise ValueError(f'sha256 must be that of the world, {source.sha256[:8]}..., '
                         f'got {msg.sha256[:8]!r}')
    return source


def is_same_world(one: WorldDescription, other: WorldDescription) -> bool:
    """Tell whether two runs are of the same world: by their hashes, where both have one."""
    if one.sha256 and other.sha256:
        return one.sha256 == other.sha256
    return _content(one) == _content(other)


def is_reset_of(description: WorldDescription, before: WorldDescription | None) -> bool:
    """Tell whether a world is the world of `before` after a reset."""
    return (before is not None and description.replaces == before.run != NO_RUN
            and is_same_world(description, before))


def with_hash(description: WorldDescription, source: Source) -> WorldDescription:
    """Return a description with the hash of its world, also where it gives none."""
    return description if description.sha256 else description._replace(sha256=source.sha256)


def description_state(msg: WorldDescription) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return a description as values for JSON, and arrays by name."""
    table = msg.table._asdict()
    arrays = {**table, 'starts': array('I', msg.starts), 'positions': msg.positions,
              'available': array('B', msg.available)}
    values = {name: value for name, value in msg._asdict().items()
              if name not in (*arrays, 'table')}
    return values, {f'world_{name}': np.array(value, dtype=value.typecode)
                    for name, value in arrays.items()}


def description_from_state(values: dict[str, Any],
                           arrays: dict[str, NDArray[Any]]) -> WorldDescription:
    """Return the description that `description_state` has made into values and arrays."""
    def stored(name: str) -> array[Any]:
        found = arrays[f'world_{name}']
        return _packed(found.dtype.char, found)
    rows, *numbers = values['grid']
    fields: dict[str, Any] = {
        **values, 'actions': tuple(values['actions']), 'cells': tuple(values['cells']),
        'grid': GridModel(tuple(rows), *numbers),
        'table': TableModel(*map(stored, TableModel._fields)),
        'starts': tuple(stored('starts')), 'positions': stored('positions'),
        'available': tuple(map(bool, stored('available')))}
    return WorldDescription(**fields)


def _spaces_of(source: Source) -> tuple[int, tuple[str, ...], tuple[int, ...]]:
    """Return the number of states of a world, the names of its actions, and its starts."""
    if isinstance(source, Grid):
        return source.width * source.height, ACTION_NAMES, source.starts
    return source.n_states, source.actions, source.starts if isinstance(source, Table) else ()


def _check_unused(msg: WorldDescription) -> None:
    """Return if what belongs to another model is empty; raises ValueError."""
    for name, model, values in (
            ('grid.rows', GRID, msg.grid.rows), ('table.first', TABLE, msg.table.first),
            ('positions', TABLE, msg.positions), ('cells', TABLE, msg.cells),
            ('available', NONE, msg.available)):
        if model != msg.model and len(values):
            raise ValueError(f'{name} must be empty in a world of model {MODELS[msg.model]}, got '
                             f'{len(values)} elements')


def _content(msg: WorldDescription) -> Any:
    """Return all that makes a world, as lists, so that it can be compared."""
    return (msg.states, list(msg.actions), list(msg.starts), msg.step_limit, msg.model,
            list(msg.grid.rows), *msg.grid[1:], [list(each) for each in msg.table],
            list(msg.available))


def _grid(msg: WorldDescription) -> Grid:
    rows, *numbers, slips_bump = msg.grid
    grid = Grid(tuple(rows), tuple(msg.starts), *numbers, msg.step_limit, slips_bump,
                expected=msg.sha256 or None)
    if msg.states != grid.width * grid.height:
        raise ValueError(f'states must be the cells of the rows, {grid.width} x {grid.height}, '
                         f'got {msg.states}')
    if tuple(msg.actions) != ACTION_NAMES:
        raise ValueError(f'the actions of a grid must be {", ".join(ACTION_NAMES)}, got '
                         f'{", ".join(msg.actions)!r:.80}')
    return grid


def _table(msg: WorldDescription) -> Table:
    successor = _unpacked(msg.table.successor, np.uint32)
    if (successor >= msg.states).any():  # as int32, it could be negative
        raise ValueError(f'a successor must be a state in [0, {msg.states - 1}], '
                         f'got {successor.max()}')
    ends = _unpacked(msg.table.terminal, np.uint32)
    if (ends >= msg.states).any() or (ends[1:] <= ends[:-1]).any():
        raise ValueError(f'terminal must be states in [0, {msg.states - 1}], ascending, got '
                         f'{ends.tolist()!r:.80}')
    if len(msg.table.first) != msg.states * len(msg.actions) + 1:
        raise ValueError('first must have an element for each action of each state, and one, '
                         f'{msg.states * len(msg.actions) + 1}, got {len(msg.table.first)}')
    terminal = np.zeros(msg.states, dtype=bool)
    terminal[ends] = True
    positions = _unpacked(msg.positions, np.float64)
    if len(positions) not in (0, 2 * msg.states):
        raise ValueError(f'positions must have x and y of each of the {msg.states} states, got '
                         f'{len(positions)} numbers')
    return Table(tuple(msg.actions), _unpacked(msg.table.first, np.uint32).astype(np.int64),
                 successor.astype(np.int32), _unpacked(msg.table.probability, np.float64),
                 _unpacked(msg.table.reward, np.float64), terminal, tuple(msg.starts),
                 msg.step_limit, positions.reshape(-1, 2) if len(positions) else None,
                 tuple(msg.cells) or None)


def _spaces(msg: WorldDescription) -> Spaces:
    if len(msg.starts):
        raise ValueError(f'starts must be empty in a world of model NONE, got {len(msg.starts)}')
    pairs = msg.states * len(msg.actions)
    if len(msg.available) not in (0, pairs):
        raise ValueError(f'available must be empty, or have each of the {len(msg.actions)} '
                         f'actions of the {msg.states} states, got {len(msg.available)} values')
    available = np.array(msg.available, dtype=bool).reshape(msg.states, -1) \
        if len(msg.available) else None
    return Spaces(msg.states, tuple(msg.actions), msg.step_limit, available)


def _packed(code: str, values: NDArray[Any]) -> array[Any]:
    """Return an `array` of a type code with the elements of any shape."""
    return array(code, values.astype(np.dtype(code)).tobytes())


def _unpacked(values: Any, kind: DTypeLike) -> NDArray[Any]:
    """Return the elements of an `array`, or of a list, as numpy has them."""
    return np.array(values, dtype=kind)
