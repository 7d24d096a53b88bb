# SPDX-License-Identifier: Apache-2.0
"""The pictures of a training: learning curve, confidence, trust map, lengths of episodes."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
import numpy as np
from numpy.typing import NDArray

from comply_ros.learner.learner_state import ONE_MENTOR
from comply_ros.plots.grid_plot import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PALE,
    place_axes,
    RED,
    set_title,
    trust_figure,
    write_picture,
)
from comply_ros.plots.mentor_marks import mentor_color, NO_NAME
from comply_ros.plots.mentor_panels import trust_panels
from comply_ros.plots.running_mean import running_mean, window_of
from comply_ros.plots.state_plot import state_trust_figure
from comply_ros.protocol.iteration_curve import IterationCurve
from comply_ros.protocol.messages import Episode
from comply_ros.world.mdp import World

BELOW_AXES = 0.5  # inches from the axes to the legend
ROW = 0.2  # inches of a row of a legend
MANY = 5  # lines of which three names side by side can be wider than the picture
Summary = Mapping[str, Any]  # of a run, as in `summary.json`
Curves = Mapping[str, tuple[Sequence[int], Sequence[float]]]


def draw_learning_curve(path: Path, curves: NDArray[np.float64], summary: Summary) -> None:
    """Write a PNG of a `learning_curve_figure`."""
    write_picture(learning_curve_figure(curves, summary), path)


def learning_curve_figure(curves: NDArray[np.float64], summary: Summary) -> Figure:
    """
    Return a figure of the mean return per iteration, with the optimal and the mentor's return.

    curves: `curves[seed, iteration]`. summary: of the first seed.
    """
    figure, axes = _new_axes(summary)
    iterations = np.arange(1, curves.shape[1] + 1)
    mean = curves.mean(axis=0)
    if len(curves) > 1:
        low, high = np.percentile(curves, (10, 90), axis=0)
        axes.fill_between(iterations, low, high, color=BLUE, alpha=0.2, linewidth=0,
                          label=f'10 % to 90 % of {len(curves)} seeds')
    elif window_of(len(mean)) > 1:
        axes.plot(iterations, mean, color=BLUE, alpha=0.3, linewidth=1,
                  label='learner, each iteration')
    axes.plot(iterations, running_mean(mean), color=BLUE, linewidth=2.2,
              label=_smooth_label('learner', len(mean), 'iterations'))
    several = summary.get('mentor_returns')
    for name, key, color, line in (
            ('optimal', 'optimal_return', GREEN, '-'),
            ('best of the mentors in each state', 'best_of_mentors_return', ORANGE, '-.'),
            ('best mentor' if several else 'mentor', 'mentor_return', ORANGE, '--')):
        level = summary.get(key)
        if level is not None:
            axes.axhline(level, color=color, linestyle=line, linewidth=1.5,
                         label=f'{name} ({level:.2f})')
    axes.set(xlabel=f'iteration ({summary["episodes"]} episodes each)',
             ylabel='mean return of an episode', xlim=(1, max(2, len(iterations))))
    _add_legend(axes)
    return figure


def draw_confidence_curves(path: Path, curves: Curves, summary: Summary) -> None:
    """Write a PNG of a `confidence_figure`."""
    write_picture(confidence_figure(curves, summary), path)


def confidence_figure(curves: Curves, summary: Summary) -> Figure:
    """
    Return a figure of the confidence in each mentor per iteration, a line for each in its color.

    curves: iterations and confidences of each mentor by its name, which may be '' of the only one;
        nan where no decision of an iteration had its advice. summary: of the run.
    """
    figure, axes = _new_axes(summary, ROW * max(0, (len(curves) + 1) // 2 - 3))
    for m, (name, (iterations, confidences)) in enumerate(curves.items()):
        axes.plot(iterations, confidences, color=mentor_color(m), linewidth=1.8,
                  marker='.' if IterationCurve(iterations, confidences).has_lone_points else None,
                  label=name or (NO_NAME if len(curves) > 1 else 'mentor'))
    last = max((max(iterations, default=0) for iterations, _ in curves.values()), default=0)
    axes.set(xlabel=f'iteration ({summary["episodes"]} episodes each)',
             ylabel='mean confidence in the advice', xlim=(1, max(2, last)), ylim=(-0.02, 1.02))
    _add_legend(axes)
    return figure


def draw_episode_lengths(path: Path, episodes: Sequence[Episode], step_limit: int,
                         summary: Summary) -> None:
    """Write a PNG of an `episode_lengths_figure`."""
    write_picture(episode_lengths_figure(episodes, step_limit, summary), path)


def episode_lengths_figure(episodes: Sequence[Episode], step_limit: int,
                           summary: Summary) -> Figure:
    """Return a figure of the number of steps of each episode; those cut off are marked."""
    figure, axes = _new_axes(summary)
    steps = np.array([each.steps for each in episodes])
    numbers = np.arange(1, len(steps) + 1)
    cut = np.array([each.truncated for each in episodes])
    axes.plot(numbers[~cut], steps[~cut], '.', color=BLUE, alpha=0.35, markersize=4,
              label='reached a goal')
    if cut.any():
        axes.plot(numbers[cut], steps[cut], 'x', color=RED, markersize=5,
                  label=f'cut off at {step_limit} steps')
    axes.plot(numbers, running_mean(steps), color=BLUE, linewidth=2.2,
              label=_smooth_label('steps', len(steps), 'episodes'))
    axes.set(xlabel='episode', ylabel='steps', xlim=(0, len(steps) + 1), ylim=(0, None))
    _add_legend(axes)
    return figure


def draw_trust_map(path: Path, world: World, advice: NDArray[Any],
                   confidence: NDArray[np.float64], visited: NDArray[np.bool_],
                   summary: Summary, mentors: Sequence[str] = ONE_MENTOR) -> None:
    """Write a PNG of a `trust_map_figure`."""
    write_picture(trust_map_figure(world, advice, confidence, visited, summary, mentors), path)


def trust_map_figure(world: World, advice: NDArray[Any], confidence: NDArray[np.float64],
                     visited: NDArray[np.bool_], summary: Summary,
                     mentors: Sequence[str] = ONE_MENTOR) -> Figure:
    """
    Return a `trust_figure` of a training, or a `state_trust_figure` where there is no grid.

    With several mentors there is a panel for each.

    summary: of its run. mentors: names; of several, advice and confidence are in rows, as in
        `Learned`.
    """
    if len(mentors) > 1:
        return trust_panels(world, f'Where {summary["method"]} follows each of its mentors; grey: '
                            'never visited', mentors, advice, confidence, visited)
    title = (f'Where {summary["method"]} follows its mentor ({summary["mentor"]}); '
             'grey: never visited')
    draw = trust_figure if world.model == 'grid' else state_trust_figure
    return draw(world, title, advice, confidence, visited)


def _new_axes(summary: Summary, legend_height: float = 0.0) -> tuple[Figure, Axes]:
    """Return a figure and its axes; legend_height: inches more than a short legend needs."""
    figure = Figure(figsize=(8, 5.2 + legend_height))
    axes = place_axes(figure, 0.9, 1.3 + legend_height, 6.9, 3.5)
    set_title(axes, f'{summary["method"]} on {summary["map"]}, mentor {summary["mentor"]}')
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.spines[['top', 'right']].set_visible(False)
    axes.grid(color='#eee')
    axes.set_axisbelow(True)
    return figure, axes


def _smooth_label(name: str, count: int, unit: str) -> str:
    """Return the label of a running mean of `count` values."""
    window = window_of(count)
    return f'{name}, running mean of {window} {unit}' if window > 1 else name


def _add_legend(axes: Axes) -> None:
    """Explain the lines below the axes, where it covers none."""
    figure, (handles, labels) = axes.get_figure(True), axes.get_legend_handles_labels()
    top = axes.get_position().y0 * figure.get_figheight() - BELOW_AXES
    figure.legend(handles, labels, loc='upper center', ncols=3 if len(labels) < MANY else 2,
                  bbox_to_anchor=(0.5, top / figure.get_figheight()), fontsize=9,
                  labelcolor=INK, framealpha=1.0, edgecolor=PALE, fancybox=False)
