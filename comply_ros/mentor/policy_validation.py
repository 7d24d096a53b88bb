# SPDX-License-Identifier: Apache-2.0
"""Whether a policy, one action for each state, fits a world."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comply_ros.world.grid import ARROWS, NO_ACTION
from comply_ros.world.mdp import World

MOST_LISTED = 8  # actions of which a message lists the names


class PolicyError(ValueError):
    """A policy that does not fit its world; the message names the rule, value and state."""


def validate_policy(policy: ArrayLike, world: World, *,
                    clear_not_free: bool = False) -> NDArray[Any]:
    """
    Return a copy of `policy[s]` that fits the world: -1, or an action that the state has.

    Its type is the `action_type` of the world.

    clear_not_free: replace advice in states where nobody can act by -1, instead of raising.

    Raises
    ------
    PolicyError: for another number of states, or the first state whose action does not fit.

    """
    try:
        actions = np.asarray(policy)
    except ValueError:  # rows of different lengths
        raise PolicyError('a policy must be one action for each state, got a nested one') from None
    if actions.shape != world.free.shape:
        where = 'map' if world.model == 'grid' else 'world'
        raise PolicyError(f'a policy must have the {world.n_states} states of the {where}, got an '
                          f'array of shape {actions.shape}')
    if actions.dtype.kind not in 'iu':
        raise PolicyError(f'a policy must be of whole numbers, got {actions.dtype}')
    in_range = (NO_ACTION <= actions) & (actions < world.n_actions)
    possible = world.available[np.arange(len(actions)), np.where(in_range, actions, 0)]
    fits = in_range & ((actions == NO_ACTION) | world.free & possible)
    if clear_not_free:
        fits |= in_range & ~world.free
    if not fits.all():
        s = int(np.flatnonzero(~fits)[0])
        validate_advice(s, int(actions[s]), world)
    return np.where(world.free, actions, NO_ACTION).astype(world.action_type)


def validate_advice(s: int, action: int, world: World) -> None:
    """
    Return if an action can be advised in state s; -1, no advice, can be everywhere.

    Raises
    ------
    PolicyError: if there is no such state or action, nobody can act there, or the state does not
        have the action.

    """
    if type(s) is not int or not 0 <= s < world.n_states:
        raise PolicyError(f'a state must lie in [0, {world.n_states - 1}], got {s!r}')
    where = position_text(s, world)
    if type(action) is not int or not NO_ACTION <= action < world.n_actions:
        raise PolicyError(f'an action must be {_actions_text(world)}, or -1 for no advice, '
                          f'got {action!r} in {where}')
    if action == NO_ACTION or world.free[s] and world.available[s, action]:
        return
    if world.model == 'grid':
        rule = 'an action must not leave the grid' if world.free[s] else \
            'a policy has advice in free cells only, from which a goal can be reached'
        raise PolicyError(f'{rule}, got {ARROWS[action]!r} in {where}')
    rule = 'an action must be one that the state has' if world.free[s] else \
        'a policy has advice only in states in which an episode can go on'
    raise PolicyError(f'{rule}, got {world.action_names[action]!r} in {where}')


def _actions_text(world: World) -> str:
    """Text that says which actions a world has."""
    if world.n_actions > MOST_LISTED:
        return f'a number in [0, {world.n_actions - 1}]'
    return ', '.join(f'{a} {name}' for a, name in enumerate(world.action_names))


def position_text(s: int, world: World) -> str:
    """Text that names state s; in a grid, by its place in the map too: the top row is row 1."""
    if world.model != 'grid':
        return f'state {s}'
    x, y = world.grid.place(s)
    return f'state {s} (row {world.grid.height - y}, column {x + 1})'
