# SPDX-License-Identifier: Apache-2.0
"""A grid as SVG layers: cells, arrows coloured by trust, the learner's arrows, the robot."""

import numpy as np

from comply_ros.world.grid import NO_ACTION

CELL = 40  # units of a cell's side
MOST_ARROWS = 10_000  # cells of a map beyond which no arrows are drawn: nobody could see them
SHADES = 12  # steps of the colour of trust
# The colours of session/grid_pictures, told apart with any colour vision, on light and on dark.
DISTRUST, HALF, TRUST = (204, 51, 17), (230, 159, 0), (0, 158, 115)
# From the middle of a cell: a broad arrow, and a slim one, for each action.
BROAD = ('m-16 0l14 -10v6h18v8h-18v6z', 'm16 0l-14 -10v6h-18v8h18v6z',
         'm0 16l-10 -14h6v-18h8v18h6z', 'm0 -16l-10 14h6v18h8v-18h6z')
SLIM = ('m9 0h-20m6 -5l-6 5l6 5', 'm-9 0h20m-6 -5l6 5l-6 5',
        'm0 -9v20m-5 -6l5 6l5 -6', 'm0 9v-20m-5 6l5 -6l5 6')


def picture_size(grid):
    """Return (width, height) of the picture of a `Grid`."""
    return grid.width * CELL, grid.height * CELL


def cell_at(grid, x, y):
    """State of the cell at a point of the picture, None outside."""
    column, row = int(x // CELL), grid.height - 1 - int(y // CELL)
    inside = 0 <= column < grid.width and 0 <= row < grid.height
    return row * grid.width + column if inside else None


def middle(grid, s):
    """Return (x, y) of the middle of the cell of state s in the picture."""
    x, y = grid.place(s)
    return x * CELL + CELL // 2, (grid.height - 1 - y) * CELL + CELL // 2


def draw_cells(world):
    """SVG of what never moves: obstacles, lines, goals, and the starts where they are few."""
    grid = world.grid
    width, height = picture_size(grid)
    lines = [f'M{x} 0V{height}' for x in range(0, width + 1, CELL)]
    lines += [f'M0 {y}H{width}' for y in range(0, height + 1, CELL)]
    walls = [f'M{x * CELL} {y * CELL}h{length * CELL}v{CELL}h-{length * CELL}z'
             for y, row in enumerate(grid.rows) for x, length in runs(row, '#')]
    signs = [star(*middle(grid, int(s))) for s in np.flatnonzero(world.terminal)]
    starts = world.starts if len(world.starts) <= 16 else ()
    signs += ['<circle cx="{}" cy="{}" r="16" class="start"/>'.format(*middle(grid, int(s)))
              for s in starts]
    return (f'<path d="{"".join(lines)}" class="lines"/>'
            f'<path d="{"".join(walls)}" class="wall"/>{"".join(signs)}')


def runs(row, sign):
    """Yield (first, length) of each row of equal signs in a text."""
    first = row.find(sign)
    while first >= 0:
        length = len(row[first:]) - len(row[first:].lstrip(sign))
        yield first, length
        first = row.find(sign, first + length)


def star(x, y):
    """SVG of a goal."""
    return (f'<path d="M{x} {y - 15}l4.4 10.2 11 .9-8.4 7.3 2.6 10.8-9.6-5.8-9.6 5.8 '
            f'2.6-10.8-8.4-7.3 11-.9z" class="goal"/>')


def draw_advice(world, advice, trust):
    """
    SVG of the mentor's arrows, red where it is not trusted, green where it is.

    advice: `a[s]`, -1 for none. trust: `p[s]` in [0, 1], or None: grey.
    """
    states = np.flatnonzero(world.free & (advice != NO_ACTION))
    if len(world.free) > MOST_ARROWS:
        return ''
    if trust is None:
        return f'<path d="{_arrows(world.grid, states, advice, BROAD)}" class="unknown"/>'
    shades = np.rint(trust[states] * SHADES)
    return ''.join(
        f'<path d="{_arrows(world.grid, states[shades == shade], advice, BROAD)}" '
        f'fill="{trust_colour(shade / SHADES)}"/>' for shade in np.unique(shades).tolist())


def draw_policy(world, policy):
    """SVG of the learner's own arrows: slim, blue, on top of the mentor's."""
    if len(world.free) > MOST_ARROWS:
        return ''
    d = _arrows(world.grid, np.flatnonzero(world.free & (policy != NO_ACTION)), policy, SLIM)
    return f'<path d="{d}" class="halo"/><path d="{d}" class="own"/>'


def draw_robot(grid, s, waits=False):
    """SVG of the robot in state s; waits: whether it waits for a person to steer."""
    x, y = middle(grid, s)
    ring = f'<circle cx="{x}" cy="{y}" r="18" class="waits"/>' if waits else ''
    return (f'{ring}<g class="robot"><circle cx="{x}" cy="{y}" r="13"/>'
            f'<circle cx="{x - 4.5}" cy="{y - 2}" r="2.6" class="eye"/>'
            f'<circle cx="{x + 4.5}" cy="{y - 2}" r="2.6" class="eye"/></g>')


def trust_colour(p):
    """Colour of a trust in [0, 1]: red, orange in the middle, green."""
    low, high, share = (DISTRUST, HALF, 2 * p) if p < 0.5 else (HALF, TRUST, 2 * p - 1)
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(low, high))
    return f'#{red:02x}{green:02x}{blue:02x}'


def _arrows(grid, states, actions, shapes):
    return ''.join('M{} {}'.format(*middle(grid, s)) + shapes[a]
                   for s, a in zip(states.tolist(), actions[states].tolist()))
