# SPDX-License-Identifier: Apache-2.0
"""Environments of Gymnasium: made, closed, and read where they have a table of transitions."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.storage.text_and_yaml_files import shown
from comply_ros.world.grid import default_step_limit, MapError, MOST_STEPS
from comply_ros.world.transition_table import Table

RGB_ARRAY = 'rgb_array'  # the render mode of Gymnasium in which `render` returns a picture


def make_environment(name: str, arguments: Mapping[str, Any], gives_pictures: bool = False) -> Any:
    """
    Return the environment of Gymnasium with a name.

    Parameters
    ----------
    name: as `gymnasium.make` takes it; `MODULE:NAME` imports a module first.
    arguments: for the environment.
    gives_pictures: whether it has the render mode `rgb_array`, if it says that it can and the
        arguments have no other; else it renders nothing.

    Raises
    ------
    MapError: if there is none, or it cannot be made with these arguments; the message says why.
    ModuleNotFoundError: if Gymnasium is not installed.

    """
    import gymnasium
    module, _, name_there = name.rpartition(':')
    try:
        if module:
            import_module(module)
        options = dict[str, Any]()
        if gives_pictures and RGB_ARRAY in _render_modes(name_there):
            options['render_mode'] = RGB_ARRAY
        return gymnasium.make(name_there, **{**options, **arguments})
    except Exception as error:  # noqa: BLE001 - its author raises what they like
        raise MapError(f'environment {shown(name)} cannot be made: {one_line(error)}') from None


def _render_modes(name: str) -> Sequence[str]:
    """Return the render modes that the class of an environment names."""
    from gymnasium.envs import registration
    namespace, plain, version = registration.parse_env_id(name)
    if version is None:  # `make` takes the newest one, and `spec` takes none
        version = registration.find_highest_version(namespace, plain)
    creator = registration.spec(registration.get_env_id(namespace, plain, version)).entry_point
    if isinstance(creator, str):
        creator = registration.load_env_creator(creator)
    metadata = getattr(creator, 'metadata', None)
    return metadata.get('render_modes') or () if isinstance(metadata, dict) else ()


def close_environment(env: Any) -> None:
    """Close an environment, which is not used any more, whatever its author raises then."""
    with suppress(Exception):
        env.close()


def one_line(error: BaseException) -> str:
    """Return what an exception says, on one line of at most 300 characters."""
    text = ' '.join(str(error).split()) or type(error).__name__
    return text if len(text) <= 300 else text[:297] + '...'


def table_of_environment(env: Any) -> Table:
    """
    Return the world of an environment of Gymnasium, from its attribute `P`.

    Raises
    ------
    MapError: if it has no discrete states and actions, no `P`, or starts that are not equally
        likely; naming the rule and the value.

    """
    base = env.unwrapped
    n_states, n_actions = (_size(kind, getattr(base, f'{kind}_space'))
                           for kind in ('observation', 'action'))
    transitions = getattr(base, 'P', None)
    if transitions is None:
        raise MapError('a map must have a table of its transitions, the attribute P, and this '
                       'environment has none')
    try:
        rows = {int(s): {int(a): [(float(p), int(s2), float(r), bool(done))
                                  for p, s2, r, done in row[a]] for a in row}
                for s, row in dict(transitions).items()}
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise MapError('P must have for each state and action a list of (probability, state, '
                       f'reward, terminated): {one_line(error)}') from None
    if len(rows) != n_states:
        raise MapError(f'P must have its {n_states} states, got {len(rows)}')
    table = Table.from_transitions(rows, _starts(base), step_limit_of(env, n_states),
                                   tuple(map(str, range(n_actions))))
    return _with_positions(table, base, n_states)


def step_limit_of(env: Any, n_states: int) -> int:
    """Return the step limit of an environment, or ten times its states where it gives none."""
    limit = env.spec.max_episode_steps if env.spec else None
    if limit is None:
        limit = getattr(env.unwrapped, 'step_limit', None)
    if type(limit) is not int or not 1 <= limit <= MOST_STEPS:
        return default_step_limit(n_states)
    return limit


def _size(kind: str, space: Any) -> int:
    """Return the number of elements of a space that numbers its elements from 0."""
    if type(space).__name__ != 'Discrete' or space.start != 0:
        raise MapError(f'the {kind} space of a map must be Discrete and begin at 0, got '
                       + shown(space))
    return int(space.n)


def _starts(base: Any) -> tuple[int, ...]:
    chances = getattr(base, 'initial_state_distrib', None)
    if chances is None:
        raise MapError('a map must say where it starts, by the attribute initial_state_distrib, '
                       'and this environment does not')
    try:
        chances = np.asarray(chances, dtype=float).reshape(-1)
    except (TypeError, ValueError) as error:
        raise MapError('initial_state_distrib must have a probability for each state: '
                       + one_line(error)) from None
    starts = np.flatnonzero(chances)
    if len(starts) and np.ptp(chances[starts]) > 1e-9:
        raise MapError('the starts of a map must be equally likely, got chances from '
                       f'{chances[starts].min():.3g} to {chances[starts].max():.3g}')
    return tuple(starts.tolist())


def _with_positions(table: Table, base: Any, n_states: int) -> Table:
    """Return the table with the cells of a grid, where the environment has the size of one."""
    shape = getattr(base, 'shape', (getattr(base, 'nrow', None), getattr(base, 'ncol', None)))
    if not (isinstance(shape, tuple) and len(shape) == 2
            and all(type(side) is int for side in shape) and prod(shape) == n_states):
        return table
    s = np.arange(table.n_states)  # one more than the environment has, where an end is apart
    positions: NDArray[np.float64] = np.stack(
        (s % shape[1] + 0.5, shape[0] - s // shape[1] - 0.5), axis=1).astype(float)
    return replace(table, positions=positions)
