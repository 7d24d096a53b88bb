# SPDX-License-Identifier: Apache-2.0
"""The pictures of a session: the learning curve, the map of trust, the lengths of episodes."""

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
import numpy as np

from comply_ros.plots.grid_plot import (
    BLUE,
    draw_trust,
    GREEN,
    grid_figure,
    INK,
    ORANGE,
    place_axes,
    RED,
    write_picture,
)

WINDOW = 9  # iterations in the running mean of a learning curve, at most


def draw_learning_curve(path, curves, summary):
    """
    Write a PNG of the mean return per iteration, with the optimal and the mentor's level.

    path: of the file.
    curves: `curves[seed, iteration]`.
    summary: of the (first) run.

    """
    figure = Figure(figsize=(8, 4.5))
    axes = place_axes(figure, 0.9, 0.6, 6.9, 3.5)
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
    _dress(axes, summary, 'center right')
    write_picture(figure, path)


def draw_episode_lengths(path, episodes, limit, summary):
    """
    Write a PNG of the steps that each `Episode` took, in their order.

    limit: steps after which an episode is cut off: those are marked.
    """
    figure = Figure(figsize=(8, 4.5))
    axes = place_axes(figure, 0.9, 0.6, 6.9, 3.5)
    steps = np.array([each.steps for each in episodes])
    numbers = np.arange(1, len(steps) + 1)
    cut = np.array([each.truncated for each in episodes])
    axes.plot(numbers[~cut], steps[~cut], '.', color=BLUE, alpha=0.35, markersize=4,
              label='reached a goal')
    if cut.any():
        axes.plot(numbers[cut], steps[cut], 'x', color=RED, markersize=5,
                  label=f'cut off at {limit} steps')
    axes.plot(numbers, running_mean(steps), color=BLUE, linewidth=2.2, label='running mean')
    axes.set(xlabel='episode', ylabel='steps', xlim=(0, len(steps) + 1), ylim=(0, None))
    _dress(axes, summary, 'upper right')
    write_picture(figure, path)


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
    figure, axes = grid_figure(
        world, f'Where {summary["method"]} listens to its mentor ({summary["mentor"]}); '
        'grey: never visited', beside=1.2)
    draw_trust(figure, axes, world, advice, confidence, visited)
    write_picture(figure, path)


def _level(axes, value, colour, name, line):
    axes.axhline(value, color=colour, linestyle=line, linewidth=1.5, label=f'{name} ({value:.2f})')


def _dress(axes, summary, legend):
    """Give axes over whole numbers their title, grid and legend."""
    axes.set_title(f'{summary["method"]} on {summary["map"]}, mentor {summary["mentor"]}',
                   loc='left', fontsize=11, color=INK)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.spines[['top', 'right']].set_visible(False)
    axes.grid(color='#eee')
    axes.set_axisbelow(True)
    axes.legend(frameon=False, loc=legend)
