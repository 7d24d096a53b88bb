# SPDX-License-Identifier: Apache-2.0
"""Grids as pictures: cells, arrows, and arrows coloured by trust."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
import numpy as np

from comply_ros.plots.viewer_geometry import TRUST_SCALE
from comply_ros.world.grid import NO_ACTION, STEPS

# Blue-green against vermilion: told apart with any kind of colour vision, and on a grey print.
BLUE, ORANGE, INK, PALE = '#0072B2', '#E69F00', '#222', '#bbb'
RED, _, GREEN = TRUST_SCALE
CORNERS = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])  # of a cell
TRUST = LinearSegmentedColormap.from_list('trust', TRUST_SCALE)


def grid_figure(world, title, size=8.0, beside=0.0):
    """
    Return a figure, and its axes with the cells of a world drawn.

    size: of the longer side of the grid, in inches. beside: more width for a colour bar.
    """
    grid = world.grid
    cell = size / max(grid.width, grid.height)
    wide, high = grid.width * cell, grid.height * cell
    figure = Figure(figsize=(wide + 0.2 + beside, high + 0.7))
    axes = place_axes(figure, 0.1, 0.3, wide, high)
    _draw_cells(axes, world)
    axes.set(xlim=(-0.7, grid.width - 0.3), ylim=(-0.7, grid.height - 0.3), aspect='equal',
             xticks=[], yticks=[])
    axes.spines[:].set_color(PALE)
    axes.set_title(title, loc='left', fontsize=11, color=INK)
    return figure, axes


def place_axes(figure, left, low, wide, high):
    """Return new axes, placed in inches: an automatic layout takes as long as the drawing."""
    width, height = figure.get_size_inches()
    return figure.add_axes((left / width, low / height, wide / width, high / height))


def _draw_cells(axes, world):
    middles = np.transpose(world.grid.place(np.flatnonzero(world.obstacle)))
    axes.add_collection(PolyCollection(middles[:, None] + CORNERS, facecolor='#d8d8d8'))
    for name, states, colour in (('goal', np.flatnonzero(world.terminal), INK),
                                 ('start', world.starts, BLUE)):
        if name == 'goal' or len(states) <= 16:
            x, y = world.grid.place(states)
            axes.scatter(x, y, s=70, marker='*' if name == 'goal' else 'o', color=colour,
                         zorder=0, alpha=1.0 if name == 'goal' else 0.35, linewidth=0)


def draw_arrows(axes, grid, states, policy, *values, **style):
    """Draw one arrow in each of the states, centred in its cell; `policy[s]` says where to."""
    x, y = grid.place(states)
    dx, dy = np.array(STEPS)[policy[states]].T * 0.72
    return axes.quiver(x, y, dx, dy, *values, pivot='mid', units='xy', scale=1, width=0.14,
                       headwidth=3.4, headlength=3.2, headaxislength=2.9, **style)


def draw_trust(figure, axes, world, policy, confidence, visited):
    """
    Draw the arrows of `policy[s]`: green where `confidence[s]` is high, red where it is low.

    visited: `visited[s]`, bool: pale arrows where the learner has never been.
    """
    there = world.free & (policy != NO_ACTION)
    draw_arrows(axes, world.grid, np.flatnonzero(there & ~visited), policy, color=PALE)
    seen = np.flatnonzero(there & visited)
    drawn = draw_arrows(axes, world.grid, seen, policy, confidence[seen], cmap=TRUST, clim=(0, 1))
    bar = figure.colorbar(drawn, cax=axes.inset_axes((1.03, 0.2, 0.025, 0.6)))
    bar.set_label('confidence in the mentor', color=INK)
    bar.outline.set_visible(False)


def write_picture(figure, path, dpi=150, effort=1):
    """
    Write a figure to a PNG file; effort: to make it small, from 1 (fast) to 9.

    Raises
    ------
    OSError: naming the file, if it cannot be written.

    """
    FigureCanvasAgg(figure)
    try:
        figure.savefig(path, dpi=dpi, facecolor='white', pil_kwargs={'compress_level': effort})
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
