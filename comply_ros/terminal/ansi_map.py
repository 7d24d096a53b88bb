# SPDX-License-Identifier: Apache-2.0
"""A map as lines of a terminal: the robot, the advice, and how far the learner trusts it."""

from comply_ros.world.grid import ARROWS, FREE, NO_ACTION

RESET, BOLD, DIM, REVERSE = '\x1b[0m', '\x1b[1m', '\x1b[2m', '\x1b[7m'
REDS_TO_GREENS = (196, 202, 208, 214, 220, 184, 148, 112, 40)  # of the 256 colours


def colour(trust):
    """Return the escape sequence of a confidence in [0, 1], from red to green."""
    last = len(REDS_TO_GREENS) - 1
    return f'\x1b[38;5;{REDS_TO_GREENS[round(min(max(trust, 0.0), 1.0) * last)]}m'


def window(focus, shown, length):
    """Return the first of `shown` places out of `length`, such that the focus is in the middle."""
    return min(max(0, focus - shown // 2), max(0, length - shown))


def map_lines(grid, policy, trust, robot, cursor, columns, rows):
    """
    Lines of a map, top row first; where it is larger than the room, what is round the cursor.

    policy: `advice[s]`, -1 for none. trust: `confidence[s]`, None where it is not known.
    robot, cursor: states, None where there is none. columns, rows: of the room.
    """
    focus = cursor if cursor is not None else robot if robot is not None else 0
    x, y = grid.place(focus)
    width, height = min(grid.width, max(1, columns // 2)), min(grid.height, max(1, rows))
    left, low = window(x, width, grid.width), window(y, height, grid.height)
    return [' '.join(_sign(row * grid.width + column, grid, policy, trust, robot, cursor)
                     for column in range(left, left + width))
            for row in range(low + height - 1, low - 1, -1)]


def _sign(state, grid, policy, trust, robot, cursor):
    cell, action = grid.cells[state], int(policy[state])
    style, sign = '', cell
    if action != NO_ACTION:
        style, sign = '' if trust is None else colour(trust[state]), ARROWS[action]
    elif cell == FREE:
        style = DIM
    if state == robot:
        style, sign = BOLD + style, '@'
    if state == cursor:
        style += REVERSE
    return f'{style}{sign}{RESET}' if style else sign
