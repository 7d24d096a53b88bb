# SPDX-License-Identifier: Apache-2.0
"""Grids as pictures: cells, arrows, and arrows colored by confidence."""

from pathlib import Path
from typing import Any
import warnings

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.quiver import Quiver
import numpy as np
from numpy.typing import NDArray

from comply_ros.plots.trust_colors import TRUST_ANCHORS
from comply_ros.storage.file_system import printable
from comply_ros.world.grid import Grid, NO_ACTION, STEPS
from comply_ros.world.mdp import World

BLUE, ORANGE, INK, PALE = '#0072B2', '#E69F00', '#222', '#bbb'
OBSTACLE = '#666'  # darker than arrows in states that were never visited, which are PALE
RED, _, GREEN = TRUST_ANCHORS
CORNERS = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])  # of a cell
MOST_STARTS = 16  # a map with more starts shows none
# What is drawn in cells besides arrows: a marker of the legend, by the label of what is drawn.
GOAL, END, START, WALL = 'goal', 'other end of an episode', 'start', 'obstacle'
CLOSED = 'cell in which the robot cannot be'  # an obstacle or a cliff
LAST = 'end of an episode'  # where goals and other ends are not told apart
MARKS: dict[str, dict[str, Any]] = {
    GOAL: {'marker': '*', 'color': INK, 'markeredgewidth': 0}, END: {'marker': 'x', 'color': INK},
    LAST: {'marker': '*', 'color': INK, 'markeredgewidth': 0},
    START: {'marker': 'o', 'color': BLUE, 'alpha': 0.35, 'markeredgewidth': 0},
    **dict.fromkeys((WALL, CLOSED), {'marker': 's', 'color': OBSTACLE, 'markeredgewidth': 0})}
LEGEND_ROOM = 0.35  # inches below what is drawn
NARROWEST = 5.6  # inches that the title of a trust map and its legend need


def grid_figure(world: World, title: str, size: float = 8.0,
                colorbar_width: float = 0.0, legend_height: float = 0.0,
                narrowest: float = 0.0) -> tuple[Figure, Axes]:
    """
    Return a figure, and its axes with the cells of a world.

    size: of the longer side of the grid, in inches.
    colorbar_width: room to the right of the grid, in inches.
    legend_height: room below it, in inches.
    narrowest: width of the figure at least, in inches.

    """
    grid = world.grid
    cell = size / max(grid.width, grid.height)
    width, height = grid.width * cell, grid.height * cell
    figure = Figure(figsize=(max(width + 0.2 + colorbar_width, narrowest),
                             height + 0.7 + legend_height))
    axes = place_axes(figure, 0.1, 0.3 + legend_height, width, height)
    draw_cells(axes, world)
    set_title(axes, title)
    return figure, axes


def draw_cells(axes: Axes, world: World) -> None:
    """Draw obstacles, goals, and the starts where they are few."""
    grid = world.grid
    centers = np.transpose(grid.place(np.flatnonzero(world.obstacle)))
    axes.add_collection(PolyCollection(list(centers[:, None] + CORNERS), facecolor=OBSTACLE,
                                       label=WALL if len(centers) else None))
    axes.scatter(*grid.place(np.flatnonzero(world.terminal)), s=70, marker='*', color=INK,
                 zorder=0, linewidth=0, label=GOAL)
    if len(world.starts) <= MOST_STARTS:
        axes.scatter(*grid.place(world.starts), s=70, color=BLUE, zorder=0, alpha=0.35,
                     linewidth=0, label=START)
    axes.set(xlim=(-0.7, grid.width - 0.3), ylim=(-0.7, grid.height - 0.3), aspect='equal',
             xticks=[], yticks=[])
    axes.spines[:].set_color(PALE)


def add_mark_legend(figure: Figure, axes: Axes) -> None:
    """Explain the marks in the cells of axes, in the lower left of the figure."""
    shown = axes.get_legend_handles_labels()[1]
    handles = [Line2D([], [], linestyle='', markersize=9, label=name, **mark)
               for name, mark in MARKS.items() if name in shown]
    if handles:
        figure.legend(handles=handles, loc='lower left', ncols=len(MARKS), frameon=False,
                      handletextpad=0.2, labelcolor=INK)


def set_title(axes: Axes, title: str) -> None:
    """Set a title that may have names that a user chose: they are no mathematics, and no TeX."""
    axes.set_title(printable(title), loc='left', fontsize=11, color=INK, parse_math=False,
                   usetex=False)


def place_axes(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Return new axes, placed in inches: an automatic layout takes as long as the drawing."""
    whole = figure.get_size_inches()
    return figure.add_axes((left / whole[0], bottom / whole[1],
                            width / whole[0], height / whole[1]))


def draw_arrows(axes: Axes, grid: Grid, states: NDArray[np.int64], policy: NDArray[np.int8],
                *values: NDArray[np.float64], **style: Any) -> Quiver:
    """
    Draw the arrow of `policy[s]` in the center of the cell of each of the states.

    values: one array with a number for each state, which `style` turns into a color, or none.
    """
    dx, dy = np.array(STEPS)[policy[states]].T * 0.72
    return axes.quiver(*grid.place(states), dx, dy, *values, pivot='mid', units='xy', scale=1,
                       width=0.14, headwidth=3.4, headlength=3.2, headaxislength=2.9, **style)


def trust_figure(world: World, title: str, advice: NDArray[np.int8],
                 confidence: NDArray[np.float64], visited: NDArray[np.bool_]) -> Figure:
    """
    Return a figure with the arrows of `advice[s]` in the colors of `confidence[s]`.

    visited: `visited[s]`; arrows are grey in states where the learner has never been.
    """
    figure, axes = grid_figure(world, title, colorbar_width=1.2, legend_height=LEGEND_ROOM,
                               narrowest=NARROWEST)
    inch = 1.0 / (axes.get_position().width * figure.get_figwidth())  # as a share of the axes
    bar = figure.colorbar(draw_trust(axes, world, advice, confidence, visited),
                          cax=axes.inset_axes((1.0 + 0.24 * inch, 0.2, 0.2 * inch, 0.6)))
    bar.set_label('confidence in the mentor', color=INK)
    bar.outline.set_visible(False)
    add_mark_legend(figure, axes)
    return figure


def draw_trust(axes: Axes, world: World, advice: NDArray[np.int8],
               confidence: NDArray[np.float64], visited: NDArray[np.bool_]) -> Quiver:
    """Draw the arrows of a `trust_figure`; return those in states that were visited."""
    advised = world.free & (advice != NO_ACTION)
    draw_arrows(axes, world.grid, np.flatnonzero(advised & ~visited), advice, color=PALE)
    states = np.flatnonzero(advised & visited)
    return draw_arrows(
        axes, world.grid, states, advice, confidence[states], clim=(0, 1),
        cmap=LinearSegmentedColormap.from_list('trust', TRUST_ANCHORS))


def write_picture(figure: Figure, path: Path, dpi: int = 150, compression: int = 1) -> None:
    """
    Write a figure to a PNG file; raises OSError with its name if that fails.

    compression: from 1 (fast) to 9 (small).
    """
    FigureCanvasAgg(figure)
    try:
        with warnings.catch_warnings():  # of a name in letters that the font does not have
            warnings.filterwarnings('ignore', 'Glyph', UserWarning)
            figure.savefig(path, dpi=dpi, facecolor='white',
                           pil_kwargs={'compress_level': compression})
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
