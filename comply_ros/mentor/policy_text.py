# SPDX-License-Identifier: Apache-2.0
"""A policy as text in the shape of the map: `<>v^`, `.` for no advice, `#` obstacle, `G` goal."""

import numpy as np

from comply_ros.world.grid import ARROWS, CELLS, FREE, NO_ACTION


class PolicyError(ValueError):
    """A policy that does not fit its map; the message names the rule and the value."""


def parse_policy(text, world):
    """
    `policy[s]`, int8, from text with one line a row, top row first; -1 where there is no advice.

    Raises
    ------
    PolicyError: for another shape, an unknown character, obstacles or goals elsewhere than in
        the map, or an action that the cell does not have.

    """
    grid, lines = world.grid, text.split()
    _check_shape(lines, grid)
    signs = ''.join(reversed(lines))
    policy = np.full(len(signs), NO_ACTION, dtype=np.int8)
    for s, (sign, cell) in enumerate(zip(signs, grid.cells)):
        if sign in ARROWS:
            policy[s] = ARROWS.index(sign)
        elif sign not in CELLS:
            raise PolicyError(f'a policy is written in {ARROWS}{CELLS}, got {sign!r} '
                              f'in {_position(s, grid)}')
        if sign in ARROWS + FREE and cell != FREE or sign not in ARROWS + FREE and sign != cell:
            raise PolicyError(f'a policy has advice in free cells only, got {sign!r} '
                              f'in {_position(s, grid)}, which is {cell!r} in the map')
    return validate_policy(policy, world)


def validate_policy(policy, world):
    """
    Return the policy.

    Raises
    ------
    PolicyError: for advice that its cell does not have.

    """
    advised = np.flatnonzero(policy != NO_ACTION)
    missing = advised[~world.available[advised, policy[advised]]]
    if len(missing):
        s = int(missing[0])
        raise PolicyError(f'an action must not leave the grid, got {ARROWS[policy[s]]!r} '
                          f'in {_position(s, world.grid)}')
    return policy


def _check_shape(lines, grid):
    if len(lines) != grid.height:
        raise PolicyError(f'a policy must have a row for each of the {grid.height} rows of the '
                          f'map, got {len(lines)}')
    for number, line in enumerate(lines, 1):
        if len(line) != grid.width:
            raise PolicyError(f'a row of a policy must have the {grid.width} cells of the map, '
                              f'got {len(line)} in row {number}')


def _position(s, grid):
    """Return where state s stands in the text: the top row is row 1."""
    x, y = grid.place(s)
    return f'row {grid.height - y}, column {x + 1}'


def format_policy(policy, world):
    """Text of `policy[s]` that `parse_policy` reads back."""
    signs = [ARROWS[a] if a != NO_ACTION else cell
             for a, cell in zip(policy.tolist(), world.grid.cells)]
    width = world.grid.width
    rows = [''.join(signs[i:i + width]) for i in range(0, len(signs), width)]
    return '\n'.join(reversed(rows)) + '\n'
