# SPDX-License-Identifier: Apache-2.0
"""A world that is no grid on its map: cells, goals, pits, and the advice in each cell."""

from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
import numpy as np
from numpy.typing import NDArray

from comply_ros.plots.grid_plot import (
    BLUE,
    CLOSED,
    CORNERS,
    END,
    GOAL,
    INK,
    MOST_STARTS,
    OBSTACLE,
    PALE,
    START,
)
from comply_ros.plots.state_layout import DIRECTIONS, goals_of, layout_of, sign
from comply_ros.world.mdp import World

MOST_CELLS = 60  # in a row or a column; arrows of smaller cells could not be told apart
POINTS = 72  # in an inch


def has_cells(world: World) -> bool:
    """Whether the states are the cells of a map that is not too large, with moves in it."""
    layout = layout_of(world)
    return (layout.is_map and max(layout.columns, layout.rows) <= MOST_CELLS
            and any(name in DIRECTIONS for name in world.action_names))


def draw_map(axes: Axes, world: World, positions: NDArray[np.float64],
             states: NDArray[np.intp], colors: NDArray[np.float64], names: list[str]) -> None:
    """
    Draw the cells of a world for which `has_cells` holds, and in some of them an action.

    positions: `positions[s]`. colors, names: of the action in each of the `states`.
    """
    side = layout_of(world).side
    low, high = positions.min(axis=0) - 0.7 * side, positions.max(axis=0) + 0.7 * side
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    room = np.array([axes.bbox.width, axes.bbox.height]) / axes.get_figure(True).dpi * POINTS
    points = float((room / (high - low)).min() * side)  # side of a cell
    _draw_cells(axes, world, positions, side, points)
    _draw_moves(axes, positions[states], side, points, colors, names)


def _draw_cells(axes: Axes, world: World, positions: NDArray[np.float64], side: float,
                points: float) -> None:
    """Draw obstacles as squares, goals as stars, other ends of an episode as crosses."""
    walls = positions[~world.free & ~world.terminal]
    axes.add_collection(PolyCollection(list(walls[:, None] + CORNERS * side), facecolor=OBSTACLE,
                                       label=CLOSED if len(walls) else None))
    goals, size = goals_of(world), (0.5 * points) ** 2
    ends = world.terminal & ~goals
    axes.scatter(*positions[goals].T, s=size, marker='*', color=INK, linewidth=0,
                 label=GOAL if goals.any() else None)
    axes.scatter(*positions[ends].T, s=size / 2, marker='x', color=INK,
                 label=END if ends.any() else None)
    axes.scatter(*positions[world.free].T, s=size / 64, color=PALE, linewidth=0, zorder=0)
    if len(world.starts) <= MOST_STARTS:
        axes.scatter(*positions[world.starts].T, s=size, color=BLUE, zorder=0, alpha=0.35,
                     linewidth=0, label=START)


def _draw_moves(axes: Axes, places: NDArray[np.float64], side: float, points: float,
                colors: NDArray[np.float64], names: list[str]) -> None:
    """Draw a direction as an arrow, and any other action by its sign."""
    steps = np.array([DIRECTIONS.get(name, (0, 0)) for name in names], float).reshape(-1, 2)
    moves = steps.any(axis=1)
    arrows = steps[moves] / np.hypot(*steps[moves].T)[:, None] * 0.72 * side
    axes.quiver(*places[moves].T, *arrows.T, color=colors[moves], pivot='mid', units='xy', scale=1,
                width=0.14 * side, headwidth=3.4, headlength=3.2, headaxislength=2.9)
    for i in np.flatnonzero(~moves).tolist():
        axes.text(*places[i], sign(names[i]), ha='center', va='center', color=colors[i],
                  fontsize=0.4 * points, parse_math=False)
