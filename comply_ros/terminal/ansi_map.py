# SPDX-License-Identifier: Apache-2.0
"""A map as lines of text: the robot, the advice, and the learner's confidence in it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from comply_ros.plots.trust_colors import xterm_trust_color
from comply_ros.world.grid import ARROWS, FREE, Grid, NO_ACTION

RESET, BOLD, DIM, REVERSE = '\x1b[0m', '\x1b[1m', '\x1b[2m', '\x1b[7m'


def map_lines(grid: Grid, policy: NDArray[np.int8], confidence: Sequence[float] | None,
              robot: int | None, cursor: int | None, columns: int, rows: int,
              has_color: bool = True) -> list[str]:
    """
    Lines of a map, top row first; of a large map, the part around the cursor or the robot.

    policy: `advice[s]`, -1 for none. confidence: `p[s]`, None if it is not known.
    robot, cursor: states, None where there is none. columns, rows: of the terminal, which has
        colors or not.
    """
    focus = cursor if cursor is not None else robot if robot is not None else 0
    x, y = grid.place(focus)
    width, height = min(grid.width, max(1, columns // 2)), min(grid.height, max(1, rows))
    left, bottom = first_shown(x, width, grid.width), first_shown(y, height, grid.height)

    def cell_text(state: int) -> str:
        cell, action, style = grid.cells[state], int(policy[state]), ''
        if action != NO_ACTION:
            cell = ARROWS[action]
            if confidence is not None and has_color:
                style = f'\x1b[38;5;{xterm_trust_color(confidence[state])}m'
        elif cell == FREE:
            style = DIM
        if state == robot:
            style, cell = BOLD + style, '@'
        if state == cursor:
            style += REVERSE
        return f'{style}{cell}{RESET}' if style else cell
    return [' '.join(cell_text(row * grid.width + column) for column in range(left, left + width))
            for row in range(bottom + height - 1, bottom - 1, -1)]


def first_shown(focus: int, shown: int, length: int) -> int:
    """First of the `shown` places, out of `length`, that have the focus in their middle."""
    return min(max(0, focus - shown // 2), max(0, length - shown))
