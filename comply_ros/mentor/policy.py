# SPDX-License-Identifier: Apache-2.0
"""Whether a policy, one action for each state, fits a world."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comply_ros.world.grid import ARROWS, Grid, NO_ACTION
from comply_ros.world.mdp import World


class PolicyError(ValueError):
    """A policy that does not fit its world; the message names the rule, value and state."""


def validate_policy(policy: ArrayLike, world: World, *,
                    clear_not_free: bool = False) -> NDArray[np.int8]:
    """
    Return a copy of `policy[s]` that fits the world: -1, or an action that the cell has.

    clear_not_free: replace advice in cells where nobody can act by -1, instead of raising.

    Raises
    ------
    PolicyError: for another number of states, or the first state whose action does not fit.

    """
    try:
        actions = np.asarray(policy)
    except ValueError:  # rows of different lengths
        raise PolicyError('a policy must be one action for each state, got a nested one') from None
    if actions.shape != world.free.shape:
        raise PolicyError(f'a policy must have the {len(world.free)} states of the map, got an '
                          f'array of shape {actions.shape}')
    if actions.dtype.kind not in 'iu':
        raise PolicyError(f'a policy must be of whole numbers, got {actions.dtype}')
    in_range = (NO_ACTION <= actions) & (actions < len(ARROWS))
    possible = world.available[np.arange(len(actions)), np.where(in_range, actions, 0)]
    fits = in_range & ((actions == NO_ACTION) | world.free & possible)
    if clear_not_free:
        fits |= in_range & ~world.free
    if not fits.all():
        s = int(np.flatnonzero(~fits)[0])
        validate_advice(s, int(actions[s]), world)
    return np.where(world.free, actions, NO_ACTION).astype(np.int8)


def validate_advice(s: int, action: int, world: World) -> None:
    """
    Return if an action can be advised in state s; -1, no advice, can be everywhere.

    Raises
    ------
    PolicyError: if there is no such state or action, nobody can act there, or the action would
        leave the grid.

    """
    if type(s) is not int or not 0 <= s < len(world.free):
        raise PolicyError(f'a state must lie in [0, {len(world.free) - 1}], got {s!r}')
    where = position_text(s, world.grid)
    if type(action) is not int or not NO_ACTION <= action < len(ARROWS):
        raise PolicyError('an action must be 0 left, 1 right, 2 down, 3 up, or -1 for no advice, '
                          f'got {action!r} in {where}')
    if action != NO_ACTION and not world.free[s]:
        raise PolicyError('a policy has advice in free cells only, from which a goal can be '
                          f'reached, got {ARROWS[action]!r} in {where}')
    if action != NO_ACTION and not world.available[s, action]:
        raise PolicyError(f'an action must not leave the grid, got {ARROWS[action]!r} in {where}')


def position_text(s: int, grid: Grid) -> str:
    """Text that names state s, by its place in the map: the top row is row 1."""
    x, y = grid.place(s)
    return f'state {s} (row {grid.height - y}, column {x + 1})'
