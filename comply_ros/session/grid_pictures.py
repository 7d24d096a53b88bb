# SPDX-License-Identifier: Apache-2.0
"""Grids as pictures: cells, arrows, and arrows coloured by trust."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PatchCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
import numpy as np

from comply_ros.core.grid import NO_ACTION, STEPS

# Blue-green against vermilion: told apart with any kind of colour vision, and on a grey print.
BLUE, GREEN, RED, ORANGE, INK, PALE = '#0072B2', '#009E73', '#CC3311', '#E69F00', '#222', '#bbb'
TRUST = LinearSegmentedColormap.from_list('trust', [RED, '#e8d9b0', GREEN])


def grid_figure(world, title, size=8.0, beside=0.0):
    """
    Return a figure, and its axes with the cells of a world drawn.

    size: of the longer side of the grid, in inches. beside: more width for a colour bar.
    """
    grid = world.grid
    cell = size / max(grid.width, grid.height)
    figure = Figure(figsize=(grid.width * cell + beside, grid.height * cell + 0.7),
                    layout='constrained')
    axes = figure.add_subplot()
    _draw_cells(axes, world)
    axes.set(xlim=(-0.7, grid.width - 0.3), ylim=(-0.7, grid.height - 0.3), aspect='equal',
             xticks=[], yticks=[])
    axes.spines[:].set_color(PALE)
    axes.set_title(title, loc='left', fontsize=11, color=INK)
    return figure, axes


def _draw_cells(axes, world):
    squares = [Rectangle((x - 0.5, y - 0.5), 1, 1)
               for x, y in map(world.grid.place, np.flatnonzero(world.obstacle))]
    axes.add_collection(PatchCollection(squares, facecolor='#d8d8d8', edgecolor='none'))
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
    bar = figure.colorbar(drawn, ax=axes, shrink=0.6, pad=0.02)
    bar.set_label('confidence in the mentor', color=INK)
    bar.outline.set_visible(False)


def write_picture(figure, path, dpi=150):
    """Write a figure to a PNG file."""
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=dpi, facecolor='white')
