# SPDX-License-Identifier: Apache-2.0
"""A world that is no grid as layers of SVG: a cell for each state, with the advised action."""

from collections.abc import Mapping
from html import escape
from math import atan2, degrees

import numpy as np
from numpy.typing import NDArray

from comply_ros.dashboard import grid_svg
from comply_ros.dashboard.grid_svg import CELL, MAX_CELLS, MAX_STARTS, SHADES, THIN, WIDE
from comply_ros.plots.mentor_marks import mentor_spots, opacity
from comply_ros.plots.state_layout import DIRECTIONS, goals_of, sign, StateLayout
from comply_ros.plots.trust_colors import trust_color
from comply_ros.protocol.state_maps import MentorReports
from comply_ros.world.grid import ACTION_NAMES, NO_ACTION, RIGHT
from comply_ros.world.mdp import World


def size(layout: StateLayout) -> tuple[int, int]:
    """Return (width, height) of the picture."""
    return layout.columns * CELL, layout.rows * CELL


def middle(layout: StateLayout, s: int) -> tuple[int, int]:
    """Return (x, y) of the middle of the cell of state s in the picture."""
    column, row = layout.places[s].tolist()
    return column * CELL + CELL // 2, row * CELL + CELL // 2


def cells(world: World, layout: StateLayout) -> str:
    """SVG of what never moves: the cells, goals, pits, and the starts where they are few."""
    width, height = size(layout)
    if world.n_states > MAX_CELLS:
        return f'<path d="M0 0h{width}v{height}h-{width}z" class="frames"/>'
    can_be = world.free | world.terminal | (not layout.is_map)
    frames, walls = [], []
    for s in range(world.n_states):
        x, y = (place * CELL for place in layout.places[s].tolist())
        (frames if can_be[s] else walls).append(f'M{x} {y}h{CELL}v{CELL}h-{CELL}z')
    marks = []
    goals = goals_of(world)
    for s in np.flatnonzero(world.terminal).tolist():
        x, y = middle(layout, s)
        marks.append(grid_svg.goal_at(x, y) if goals[s] else
                     f'<circle cx="{x}" cy="{y}" r="12" class="pit"/>')
    for s in world.starts.tolist() if len(world.starts) <= MAX_STARTS else ():
        marks.append(grid_svg.start_at(*middle(layout, s)))
    return (f'<path d="{"".join(frames)}" class="frames"/>'
            f'<path d="{"".join(walls)}" class="wall"/>{"".join(marks)}')


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


def arrows_of_mentors(world: World, layout: StateLayout, mentors: Mapping[int, MentorReports],
                      learned: NDArray[np.int8] | None) -> str:
    """SVG of the actions of several mentors, as `grid_svg.arrows_of_mentors` has them."""
    if len(world.free) > MAX_CELLS:
        return ''
    groups = []
    for spot, (m, known) in zip(mentor_spots(len(mentors)), mentors.items()):
        policy, trust, marks = known.policy, known.trust, []
        if policy is None:
            continue
        visited = grid_svg.visited_states(len(policy), trust, learned)
        for s in np.flatnonzero(world.free & (policy != NO_ACTION)).tolist():
            look = 'class="never-visited"' if trust is None or not visited[s] else \
                f'opacity="{opacity(round(float(trust[s]) * SHADES) / SHADES):.2f}"'
            marks.append(_mark(world, layout, s, int(policy[s]), WIDE, look, spot.size))
        groups.append(f'<g {grid_svg.look_of_mentor(m, spot)}>{"".join(marks)}</g>')
    return ''.join(groups)


def learner_arrows(world: World, layout: StateLayout, policy: NDArray[np.int8]) -> str:
    """SVG of the learner's actions, thin and blue."""
    if len(world.free) > MAX_CELLS:
        return ''
    return ''.join(_mark(world, layout, s, int(policy[s]), THIN, 'class="learner"')
                   for s in np.flatnonzero(world.free & (policy != NO_ACTION)).tolist())


def robot(layout: StateLayout, s: int, waits: bool = False) -> str:
    """SVG of the robot in state s."""
    return grid_svg.robot_at(*middle(layout, s), waits)


def _mark(world: World, layout: StateLayout, s: int, action: int, shapes: tuple[str, ...],
          look: str, scale: float = 1.0) -> str:
    """SVG of an action in the cell of a state, to be drawn in a scale: an arrow, or its sign."""
    x, y = (f'{each / scale:g}' for each in middle(layout, s))
    name = world.action_names[action]
    if layout.is_map and name in ACTION_NAMES:
        return f'<path d="M{x} {y}{shapes[ACTION_NAMES.index(name)]}" {look}/>'
    if layout.is_map and name in DIRECTIONS:
        across, up = DIRECTIONS[name]
        turn = f'rotate({round(degrees(atan2(-up, across)))} {x} {y})'
        return f'<path d="M{x} {y}{shapes[RIGHT]}" transform="{turn}" {look}/>'
    return (f'<text x="{x}" y="{y}" dy="6" text-anchor="middle" font-size="17" {look}>'
            f'{escape(sign(name))}</text>')
