# SPDX-License-Identifier: Apache-2.0
"""A grid as layers of SVG: cells, the mentor's arrows, the learner's arrows, and the robot."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from comply_ros.plots.mentor_marks import mentor_color, mentor_spots, opacity, Spot
from comply_ros.plots.trust_colors import trust_color
from comply_ros.protocol.state_maps import MentorReports
from comply_ros.world.grid import Grid, NO_ACTION
from comply_ros.world.mdp import World

CELL = 40  # length of a cell's side
MAX_CELLS = 10_000  # of a map: in a larger one no arrows are drawn, since nobody could see them
MAX_STARTS = 16  # more are not drawn: they would be everywhere
SHADES = 12  # steps of trust that are told apart by colour
# An arrow for each action, from the middle of its cell: wide for the mentor, thin for the learner.
WIDE = ('m-16 0l14 -10v6h18v8h-18v6z', 'm16 0l-14 -10v6h-18v8h18v6z',
        'm0 16l-10 -14h6v-18h8v18h6z', 'm0 -16l-10 14h6v18h8v-18h6z')
THIN = ('m9 0h-20m6 -5l-6 5l6 5', 'm-9 0h20m-6 -5l6 5l-6 5',
        'm0 -9v20m-5 -6l5 6l5 -6', 'm0 9v-20m-5 6l5 -6l5 6')


def size(grid: Grid) -> tuple[int, int]:
    """Return (width, height) of the picture of a grid."""
    return grid.width * CELL, grid.height * CELL


def state_at(grid: Grid, x: float, y: float) -> int | None:
    """State of the cell at a point of the picture, None outside."""
    column, row = int(x // CELL), grid.height - 1 - int(y // CELL)
    inside = 0 <= column < grid.width and 0 <= row < grid.height
    return row * grid.width + column if inside else None


def middle(grid: Grid, s: int) -> tuple[int, int]:
    """Return (x, y) of the middle of the cell of state s in the picture."""
    x, y = grid.place(s)
    return x * CELL + CELL // 2, (grid.height - 1 - y) * CELL + CELL // 2


def cells(world: World) -> str:
    """SVG of what never moves: lines, obstacles, goals, and the starts where they are few."""
    grid = world.grid
    width, height = size(grid)
    lines = [f'M{x} 0V{height}' for x in range(0, width + 1, CELL)]
    lines += [f'M0 {y}H{width}' for y in range(0, height + 1, CELL)]
    walls = [f'M{x * CELL} {y * CELL}h{length * CELL}v{CELL}h-{length * CELL}z'
             for y, row in enumerate(grid.rows) for x, length in spans(row, '#')]
    marks = []
    marks += [goal_at(*middle(grid, s)) for s in np.flatnonzero(world.terminal).tolist()]
    for s in world.starts.tolist() if len(world.starts) <= MAX_STARTS else ():
        marks.append(start_at(*middle(grid, s)))
    return (f'<path d="{"".join(lines)}" class="lines"/>'
            f'<path d="{"".join(walls)}" class="wall"/>{"".join(marks)}')


def goal_at(x: int, y: int) -> str:
    """SVG of a star at a point."""
    return (f'<path d="M{x} {y - 15}l4.4 10.2 11 .9-8.4 7.3 2.6 10.8-9.6-5.8-9.6 5.8 '
            '2.6-10.8-8.4-7.3 11-.9z" class="goal"/>')


def start_at(x: int, y: int) -> str:
    """SVG of the ring of a start at a point."""
    return f'<circle cx="{x}" cy="{y}" r="16" class="start"/>'


def spans(row: str, sign: str) -> Iterator[tuple[int, int]]:
    """Yield (first index, length) of each group of equal signs in a text."""
    first = row.find(sign)
    while first >= 0:
        length = len(row[first:]) - len(row[first:].lstrip(sign))
        yield first, length
        first = row.find(sign, first + length)


def mentor_arrows(world: World, policy: NDArray[np.int8], trust: NDArray[np.float32] | None,
                  learned: NDArray[np.int8] | None) -> str:
    """
    SVG of the mentor's arrows, from red (not trusted) over amber to green (trusted).

    Arrows are grey in states that the learner knows nothing of, since it was never there.

    policy: `a[s]`, -1 for no advice.
    trust: `p[s]` in [0, 1], None while unknown.
    learned: the learner's policy, -1 where it knows nothing, None while unknown.

    """
    states = np.flatnonzero(world.free & (policy != NO_ACTION))
    if len(world.free) > MAX_CELLS:
        return ''
    visited = visited_states(len(policy), trust, learned)
    others, states = states[~visited[states]], states[visited[states]]
    grey = f'<path d="{_arrows(world.grid, others, policy, WIDE)}" class="unknown"/>'
    if trust is None or not len(states):
        return grey if len(others) else ''
    shades = np.rint(trust[states] * SHADES)
    return (grey if len(others) else '') + ''.join(
        f'<path d="{_arrows(world.grid, states[shades == shade], policy, WIDE)}" '
        f'fill="{trust_color(shade / SHADES)}"/>' for shade in np.unique(shades).tolist())


def arrows_of_mentors(world: World, mentors: Mapping[int, MentorReports],
                      learned: NDArray[np.int8] | None) -> str:
    """
    SVG of the arrows of several mentors, each in its own color and part of the cell.

    An arrow is the fainter, the less the mentor is trusted there; only its outline is drawn in
    states that the learner knows nothing of.

    mentors: by place, which gives the color.
    """
    return '' if len(world.free) > MAX_CELLS else ''.join(
        f'<g {look_of_mentor(m, spot)}>{_arrows_of(world, known, spot, learned)}</g>'
        for spot, (m, known) in zip(mentor_spots(len(mentors)), mentors.items())
        if known.policy is not None)


def look_of_mentor(m: int, spot: Spot) -> str:
    """Attributes of a group that has the color of mentor m, and whose cells are in a spot."""
    return (f'color="{mentor_color(m)}" class="mentor" transform='
            f'"translate({spot.right * CELL:g} {0.0 - spot.up * CELL:g}) scale({spot.size:g})"')


def _arrows_of(world: World, known: MentorReports, spot: Spot,
               learned: NDArray[np.int8] | None) -> str:
    """SVG of the arrows of one of several mentors, in the scale of its spot."""
    policy, trust = known.policy, known.trust
    assert policy is not None
    states = np.flatnonzero(world.free & (policy != NO_ACTION))
    visited = visited_states(len(policy), trust, learned)[states]
    outlines = _arrows(world.grid, states[~visited], policy, WIDE, spot.size)
    paths = [f'<path d="{outlines}" class="never-visited"/>'] if outlines else []
    if trust is not None:
        states = states[visited]
        shades = np.rint(trust[states] * SHADES)
        for each in np.unique(shades).tolist():
            arrows = _arrows(world.grid, states[shades == each], policy, WIDE, spot.size)
            paths.append(f'<path d="{arrows}" opacity="{opacity(each / SHADES):.2f}"/>')
    return ''.join(paths)


def visited_states(n_states: int, trust: NDArray[np.float32] | None,
                   learned: NDArray[np.int8] | None) -> NDArray[np.bool_]:
    """Return in which states a trust is known: arguments as in `mentor_arrows`."""
    return np.zeros(n_states, dtype=bool) if trust is None or learned is None \
        else learned != NO_ACTION


def learner_arrows(world: World, policy: NDArray[np.int8]) -> str:
    """SVG of the learner's arrows: thin, blue, on top of the mentor's."""
    if len(world.free) > MAX_CELLS:
        return ''
    path = _arrows(world.grid, np.flatnonzero(world.free & (policy != NO_ACTION)), policy, THIN)
    return f'<path d="{path}" class="halo"/><path d="{path}" class="learner"/>'


def robot(grid: Grid, s: int, waits: bool = False) -> str:
    """SVG of the robot in state s; waits: whether it waits for a person who steers."""
    return robot_at(*middle(grid, s), waits)


def robot_at(x: int, y: int, waits: bool = False) -> str:
    """SVG of the robot at a point."""
    ring = f'<circle cx="{x}" cy="{y}" r="18" class="waits"/>' if waits else ''
    return (f'{ring}<g class="robot"><circle cx="{x}" cy="{y}" r="13"/>'
            f'<circle cx="{x - 4.5}" cy="{y - 2}" r="2.6" class="eye"/>'
            f'<circle cx="{x + 4.5}" cy="{y - 2}" r="2.6" class="eye"/></g>')


def _arrows(grid: Grid, states: NDArray[np.intp], actions: NDArray[np.int8],
            shapes: tuple[str, ...], scale: float = 1.0) -> str:
    """Path of an arrow in each of the states, to be drawn in that scale."""
    return ''.join('M{:g} {:g}'.format(*(each / scale for each in middle(grid, s))) + shapes[a]
                   for s, a in zip(states.tolist(), actions[states].tolist()))
