# SPDX-License-Identifier: Apache-2.0
"""
A policy as text, in the shape of the map or with a line for each state.

In a grid it has a character for each cell: `<>v^`, `.` for no advice, `#` obstacle, `G` goal. In
other worlds it has a line `STATE ACTION` for each state with advice, such as `12 pickup`.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.mentor.policy_validation import (
    MOST_LISTED,
    PolicyError,
    position_text,
    validate_policy,
)
from comply_ros.world.grid import ARROWS, CELLS, FREE, NO_ACTION
from comply_ros.world.mdp import World


def parse_policy(text: str, world: World) -> NDArray[Any]:
    """
    `policy[s]` from text; -1 where there is no advice.

    Advice in states where nobody can act, such as free cells from which no goal can be reached,
    is left out.

    Raises
    ------
    PolicyError: for another shape, an unknown character or name, obstacles or goals elsewhere
        than in the map, or an action that the state does not have.

    """
    policy = _parse_rows(text, world) if world.model == 'grid' else _parse_lines(text, world)
    return validate_policy(policy, world, clear_not_free=True)


def format_policy(policy: NDArray[Any], world: World) -> str:
    """Text of `policy[s]` that `parse_policy` reads back."""
    if world.model != 'grid':
        names = world.action_names
        return ''.join(f'{s} {names[a]}\n' for s, a in enumerate(policy.tolist())
                       if a != NO_ACTION)
    signs = [ARROWS[a] if a != NO_ACTION else cell
             for a, cell in zip(policy.tolist(), world.grid.cells)]
    width = world.grid.width
    rows = [''.join(signs[i:i + width]) for i in range(0, len(signs), width)]
    return '\n'.join(reversed(rows)) + '\n'


def _parse_rows(text: str, world: World) -> NDArray[Any]:
    """Return `policy[s]` from a line for each row of the map, top row first."""
    grid, lines = world.grid, text.split()
    if len(lines) != grid.height:
        raise PolicyError(f'a policy must have a row for each of the {grid.height} rows of the '
                          f'map, got {len(lines)}')
    for number, line in enumerate(lines, 1):
        if len(line) != grid.width:
            raise PolicyError(f'a row of a policy must have the {grid.width} cells of the map, '
                              f'got {len(line)} in row {number}')
    policy = np.full(world.n_states, NO_ACTION, dtype=world.action_type)
    for s, (sign, cell) in enumerate(zip(''.join(reversed(lines)), grid.cells)):
        if sign in ARROWS:
            policy[s] = ARROWS.index(sign)
        elif sign not in CELLS:
            raise PolicyError(f'a policy is written in {ARROWS}{CELLS}, got {sign!r} '
                              f'in {position_text(s, world)}')
        if cell != (FREE if sign in ARROWS else sign):
            raise PolicyError(f'a policy has advice in free cells only, got {sign!r} '
                              f'in {position_text(s, world)}, which is {cell!r} in the map')
    return policy


def _parse_lines(text: str, world: World) -> NDArray[Any]:
    """Return `policy[s]` from a line for each state with advice, in any order."""
    policy = np.full(world.n_states, NO_ACTION, dtype=world.action_type)
    actions = {name: a for a, name in enumerate(world.action_names)}
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip():
            continue
        state, _, name = line.strip().partition(' ')
        if not state.isdecimal() or not name:
            raise PolicyError('in a world that is no grid, a line of a policy must be a state and '
                              f"the name of an action, such as '0 {world.action_names[0]}', got "
                              f'{line!r:.80} in line {number}')
        if len(state) > len(str(world.n_states)) or int(state) >= world.n_states:
            raise PolicyError(f'a state must lie in [0, {world.n_states - 1}], got {state:.20} in '
                              f'line {number}')
        if name.strip() not in actions:
            known = ', '.join(world.action_names[:MOST_LISTED])
            known += ', ...' if world.n_actions > MOST_LISTED else ''
            raise PolicyError(f'an action must be one of {known}, got {name.strip()!r:.80} in '
                              f'line {number}')
        s = int(state)
        if policy[s] != NO_ACTION:
            raise PolicyError(f'a policy must have one action for each state, got a second one '
                              f'for state {s} in line {number}')
        policy[s] = actions[name.strip()]
    return policy
