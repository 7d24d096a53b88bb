# SPDX-License-Identifier: Apache-2.0
"""
A world that is no grid as layers of SVG: a cell for each state, with the action that is advised.

Where every state has a place of its own the cells are there, as on a map. Where states have no
place, or share one, the cells are in the order of the states, as in a table that is read by lines.
"""

from __future__ import annotations

from html import escape
from math import ceil, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.dashboard import grid_svg
from comply_ros.dashboard.grid_svg import CELL, MAX_CELLS, MAX_STARTS, SHADES, THIN, WIDE
from comply_ros.plots.trust_colors import trust_color
from comply_ros.world.grid import ACTION_NAMES, NO_ACTION, RIGHT
from comply_ros.world.mdp import World

SPARSEST = 4  # a map has at most so many times more cells than states
SAME = 1e-4  # of the width of the world: coordinates that differ by less are the same
TOLERANCE = 0.1  # of a cell, by which a place may be off
TURNS = {'up_left': -135, 'up_right': -45, 'down_left': 135, 'down_right': 45}  # of one right
SIGNS = {'left': '\u2190', 'right': '\u2192', 'down': '\u2193', 'up': '\u2191',
         'up_left': '\u2196', 'up_right': '\u2197', 'down_left': '\u2199',
         'down_right': '\u2198', 'stay': '\u2022'}
LONGEST_SIGN = 3  # characters of an action that is no direction


class StateLayout(NamedTuple):
    """
    Where the cell of each state is.

    Attributes
    ----------
    columns, rows: of the picture.
    places: `places[s]`, int64: column and row, from the upper left.
    is_map: whether the places are those of the world.

    """

    columns: int
    rows: int
    places: NDArray[np.int64]
    is_map: bool

    def size(self) -> tuple[int, int]:
        """Return (width, height) of the picture."""
        return self.columns * CELL, self.rows * CELL

    def middle(self, s: int) -> tuple[int, int]:
        """Return (x, y) of the middle of the cell of state s in the picture."""
        column, row = self.places[s].tolist()
        return column * CELL + CELL // 2, row * CELL + CELL // 2


def layout_of(world: World) -> StateLayout:
    """Return where the states of a world are drawn."""
    on_map = _map_places(world.positions)
    if on_map is not None:
        columns, rows = (on_map.max(axis=0) + 1).tolist()
        return StateLayout(columns, rows, on_map, True)
    columns = ceil(sqrt(world.n_states))
    s = np.arange(world.n_states)
    return StateLayout(columns, ceil(world.n_states / columns),
                       np.stack((s % columns, s // columns), axis=1), False)


def _map_places(positions: NDArray[np.float64] | None) -> NDArray[np.int64] | None:
    """Return column and row of each position, None unless they are cells of their own."""
    if positions is None or len(np.unique(positions, axis=0)) < len(positions):
        return None
    steps = np.concatenate([np.diff(np.unique(positions[:, k])) for k in range(2)])
    steps = steps[steps > SAME * np.ptp(positions, axis=0).max()]
    side = float(steps.min()) if len(steps) else 1.0
    exact = (positions - positions.min(axis=0)) / side
    places = np.rint(exact).astype(np.int64)
    if np.abs(exact - places).max() > TOLERANCE or len(np.unique(places, axis=0)) < len(places):
        return None
    places[:, 1] = places[:, 1].max() - places[:, 1]  # y is up in the world, and down in pictures
    columns, rows = (places.max(axis=0) + 1).tolist()
    return places if columns * rows <= SPARSEST * len(places) + 1 else None


def cells(world: World, layout: StateLayout) -> str:
    """SVG of what never moves: the cells, goals, pits, and the starts where they are few."""
    width, height = layout.size()
    if world.n_states > MAX_CELLS:
        return f'<path d="M0 0h{width}v{height}h-{width}z" class="frames"/>'
    can_be = world.free | world.terminal | (not layout.is_map)
    frames, walls = [], []
    for s in range(world.n_states):
        x, y = (place * CELL for place in layout.places[s].tolist())
        (frames if can_be[s] else walls).append(f'M{x} {y}h{CELL}v{CELL}h-{CELL}z')
    marks = []
    goals = _goals(world)
    for s in np.flatnonzero(world.terminal).tolist():
        x, y = layout.middle(s)
        marks.append(grid_svg.goal_at(x, y) if goals[s] else
                     f'<circle cx="{x}" cy="{y}" r="12" class="pit"/>')
    for s in world.starts.tolist() if len(world.starts) <= MAX_STARTS else ():
        marks.append(grid_svg.start_at(*layout.middle(s)))
    return (f'<path d="{"".join(frames)}" class="frames"/>'
            f'<path d="{"".join(walls)}" class="wall"/>{"".join(marks)}')


def _goals(world: World) -> NDArray[np.bool_]:
    """Return which terminal states are goals: no other one earns more to enter."""
    entering = np.full(world.n_states, -np.inf)
    if world.model == 'table':
        np.maximum.at(entering, world.table.successor, world.table.reward)
    best = entering[world.terminal].max(initial=-np.inf)
    return world.terminal & (entering >= best)


def mentor_arrows(world: World, layout: StateLayout, policy: NDArray[np.int8],
                  trust: NDArray[np.float32] | None,
                  learned: NDArray[np.int8] | None) -> str:
    """SVG of the advised actions, in the colours of `grid_svg.mentor_arrows`."""
    if len(world.free) > MAX_CELLS:
        return ''
    visited, marks = grid_svg.visited_states(len(policy), trust, learned), []
    for s in np.flatnonzero(world.free & (policy != NO_ACTION)).tolist():
        look = 'class="unknown"'
        if trust is not None and visited[s]:
            look = f'fill="{trust_color(round(float(trust[s]) * SHADES) / SHADES)}"'
        marks.append(_mark(world, layout, s, int(policy[s]), WIDE, look))
    return ''.join(marks)


def learner_arrows(world: World, layout: StateLayout, policy: NDArray[np.int8]) -> str:
    """SVG of the learner's actions, thin and blue."""
    if len(world.free) > MAX_CELLS:
        return ''
    return ''.join(_mark(world, layout, s, int(policy[s]), THIN, 'class="learner"')
                   for s in np.flatnonzero(world.free & (policy != NO_ACTION)).tolist())


def robot(layout: StateLayout, s: int, waits: bool = False) -> str:
    """SVG of the robot in state s."""
    return grid_svg.robot_at(*layout.middle(s), waits)


def sign(name: str) -> str:
    """Return an action in up to three characters: a direction as an arrow, `pick_up` as `pu`."""
    if name in SIGNS:
        return SIGNS[name]
    words = name.replace('_', ' ').split()
    if len(name) > LONGEST_SIGN and len(words) > 1:
        name = ''.join(word[0] for word in words)
    return name[:LONGEST_SIGN]


def _mark(world: World, layout: StateLayout, s: int, action: int, shapes: tuple[str, ...],
          look: str) -> str:
    """SVG of an action in the cell of a state: an arrow, or its sign."""
    x, y = layout.middle(s)
    name = world.action_names[action]
    if layout.is_map and name in ACTION_NAMES:
        return f'<path d="M{x} {y}{shapes[ACTION_NAMES.index(name)]}" {look}/>'
    if layout.is_map and name in TURNS:
        return (f'<path d="M{x} {y}{shapes[RIGHT]}" transform="rotate({TURNS[name]} {x} {y})" '
                f'{look}/>')
    return (f'<text x="{x}" y="{y + 6}" text-anchor="middle" font-size="17" {look}>'
            f'{escape(sign(name))}</text>')
