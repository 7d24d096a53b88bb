# SPDX-License-Identifier: Apache-2.0
"""The two pictures of a session: the learning curve, and the map of trust."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PatchCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator
import numpy as np

from comply_ros.core.grid import NO_ACTION, STEPS

# Blue-green against vermilion: told apart with any kind of colour vision, and on a grey print.
BLUE, GREEN, RED, ORANGE, INK, PALE = '#0072B2', '#009E73', '#CC3311', '#E69F00', '#222', '#bbb'
TRUST = LinearSegmentedColormap.from_list('trust', [RED, '#e8d9b0', GREEN])
WINDOW = 9  # iterations in the running mean of a learning curve, at most


def draw_learning_curve(path, curves, summary):
    """
    Write a PNG of the mean return per iteration, with the optimal and the mentor's level.

    path: of the file.
    curves: `curves[seed, iteration]`.
    summary: of the (first) run.

    """
    figure = Figure(figsize=(8, 4.5), layout='constrained')
    axes = figure.add_subplot()
    iterations = np.arange(1, curves.shape[1] + 1)
    mean = curves.mean(axis=0)
    if len(curves) > 1:
        low, high = np.percentile(curves, (10, 90), axis=0)
        axes.fill_between(iterations, low, high, color=BLUE, alpha=0.2, linewidth=0,
                          label=f'10 % to 90 % of {len(curves)} seeds')
    else:
        axes.plot(iterations, mean, color=BLUE, alpha=0.3, linewidth=1)
    axes.plot(iterations, running_mean(mean), color=BLUE, linewidth=2.2, label='learner')
    _level(axes, summary['optimal_return'], GREEN, 'optimal', '-')
    if summary['mentor_return'] is not None:
        _level(axes, summary['mentor_return'], ORANGE, 'mentor', '--')
    axes.set(xlabel=f'iteration ({summary["episodes"]} episodes each)',
             ylabel='mean return of an episode', xlim=(1, max(2, len(iterations))))
    axes.set_title(f'{summary["method"]} on {summary["map"]}, mentor {summary["mentor"]}',
                   loc='left', fontsize=11, color=INK)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.spines[['top', 'right']].set_visible(False)
    axes.grid(color='#eee')
    axes.set_axisbelow(True)
    axes.legend(frameon=False, loc='center right')
    _write(figure, path)


def running_mean(values):
    """Mean over a window of iterations that is centred, and cut at both ends."""
    reach = min(WINDOW, len(values) // 8) // 2
    return np.array([values[max(0, i - reach):i + reach + 1].mean() for i in range(len(values))])


def draw_trust_map(path, world, advice, confidence, visited, summary):
    """
    Write a PNG of the mentor's arrows: green where the learner listens, red where it does not.

    path: of the file.
    world: the `World`.
    advice: `advice[s]`, the mentor's actions.
    confidence: `p[s]`.
    visited: `visited[s]`, bool: pale arrows where the learner has never been.
    summary: of the run.

    """
    grid = world.grid
    size = 8.0 / max(grid.width, grid.height)
    figure = Figure(figsize=(grid.width * size + 1.2, grid.height * size + 0.7),
                    layout='constrained')
    axes = figure.add_subplot()
    _draw_cells(axes, world)
    there = world.free & (advice != NO_ACTION)
    _arrows(axes, grid, np.flatnonzero(there & ~visited), advice, color=PALE)
    seen = np.flatnonzero(there & visited)
    drawn = _arrows(axes, grid, seen, advice, confidence[seen], cmap=TRUST, clim=(0, 1))
    bar = figure.colorbar(drawn, ax=axes, shrink=0.6, pad=0.02)
    bar.set_label('confidence in the mentor', color=INK)
    bar.outline.set_visible(False)
    axes.set(xlim=(-0.7, grid.width - 0.3), ylim=(-0.7, grid.height - 0.3), aspect='equal',
             xticks=[], yticks=[])
    axes.spines[:].set_color(PALE)
    axes.set_title(f'Where {summary["method"]} listens to its mentor ({summary["mentor"]}); '
                   'grey: never visited', loc='left', fontsize=11, color=INK)
    _write(figure, path)


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


def _arrows(axes, grid, states, advice, *values, **style):
    """Draw one arrow in each of the states, centred in its cell."""
    x, y = grid.place(states)
    dx, dy = np.array(STEPS)[advice[states]].T * 0.72
    return axes.quiver(x, y, dx, dy, *values, pivot='mid', units='xy', scale=1, width=0.14,
                       headwidth=3.4, headlength=3.2, headaxislength=2.9, **style)


def _level(axes, value, colour, name, line):
    axes.axhline(value, color=colour, linestyle=line, linewidth=1.5, label=f'{name} ({value:.2f})')


def _write(figure, path):
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=150, facecolor='white')
