# SPDX-License-Identifier: Apache-2.0
"""A policy as text in the shape of the map: `<>v^`, `.` for no advice, `#` obstacle, `G` goal."""

import numpy as np
from numpy.typing import NDArray

from comply_ros.mentor.policy import PolicyError, position_text, validate_policy
from comply_ros.world.grid import ARROWS, CELLS, FREE, NO_ACTION
from comply_ros.world.mdp import World


def parse_policy(text: str, world: World) -> NDArray[np.int8]:
    """
    `policy[s]` from text with one line a row, top row first; -1 where there is no advice.

    Advice in free cells from which no goal can be reached is left out.

    Raises
    ------
    PolicyError: for another shape, an unknown character, obstacles or goals elsewhere than in
        the map, or an action that the cell does not have.

    """
    grid, lines = world.grid, text.split()
    if len(lines) != grid.height:
        raise PolicyError(f'a policy must have a row for each of the {grid.height} rows of the '
                          f'map, got {len(lines)}')
    for number, line in enumerate(lines, 1):
        if len(line) != grid.width:
            raise PolicyError(f'a row of a policy must have the {grid.width} cells of the map, '
                              f'got {len(line)} in row {number}')
    policy = np.full(len(grid.cells), NO_ACTION, dtype=np.int8)
    for s, (sign, cell) in enumerate(zip(''.join(reversed(lines)), grid.cells)):
        if sign in ARROWS:
            policy[s] = ARROWS.index(sign)
        elif sign not in CELLS:
            raise PolicyError(f'a policy is written in {ARROWS}{CELLS}, got {sign!r} '
                              f'in {position_text(s, grid)}')
        if cell != (FREE if sign in ARROWS else sign):
            raise PolicyError(f'a policy has advice in free cells only, got {sign!r} '
                              f'in {position_text(s, grid)}, which is {cell!r} in the map')
    return validate_policy(policy, world, clear_not_free=True)


def format_policy(policy: NDArray[np.int8], world: World) -> str:
    """Text of `policy[s]` that `parse_policy` reads back."""
    signs = [ARROWS[a] if a != NO_ACTION else cell
             for a, cell in zip(policy.tolist(), world.grid.cells)]
    width = world.grid.width
    rows = [''.join(signs[i:i + width]) for i in range(0, len(signs), width)]
    return '\n'.join(reversed(rows)) + '\n'
