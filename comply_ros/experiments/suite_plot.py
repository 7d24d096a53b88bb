# SPDX-License-Identifier: Apache-2.0
"""The picture of the suite: in each world, ratios of regrets."""

from collections.abc import Mapping, Sequence
from math import nan
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

from comply_ros.experiments.suite_numbers import MENTOR_FACTOR, Numbers
from comply_ros.experiments.suite_runs import ALONE, MENTORS
from comply_ros.plots.grid_plot import BLUE, GREEN, INK, ORANGE, RED

COLORS = {'optimal': GREEN, 'noisy:0.3': BLUE, 'snapshot:0.75': '#56B4E9', 'random': ORANGE,
          'adversarial': RED}
WITHOUT_REGRET = 0.5  # a mean regret below this is shown as 0, and is no denominator
EDGES = 3.0, 1.5  # of the two axes


def ratio(value: Mapping[str, float], of: Mapping[str, float]) -> float:
    """Return the ratio of two mean regrets; nan where there is none to compare with."""
    return nan if of['mean'] < WITHOUT_REGRET else value['mean'] / of['mean']


def suite_figure(worlds: Sequence[Numbers]) -> Figure:
    """Return the picture: a row for each world, as `world_numbers` gives them."""
    figure = Figure(figsize=(8.4, 1.6 + 0.25 * len(worlds)), layout='constrained')
    axes: Any = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
    regrets = [world['regret'] for world in worlds]
    for mentor in MENTORS:
        _draw(axes[0], [ratio(each[mentor], each[ALONE]) for each in regrets], EDGES[0],
              COLORS[mentor], mentor)
    _draw(axes[1], [ratio(each[ALONE], each[world['best']])
                    for each, world in zip(regrets, worlds, strict=True)], EDGES[1], INK)
    titles = 'with a mentor / without one', 'without one / best other method'
    for each, title, edge, most in zip(axes, titles, EDGES, (MENTOR_FACTOR, 1.0), strict=True):
        each.axvline(most, color=INK, linestyle='--', linewidth=1.2, zorder=1)
        each.set_xlim(-0.05 * edge, 1.03 * edge)
        each.set_title(title, loc='left', fontsize=11, color=INK)
        each.set_xlabel('ratio of the regrets')
        each.spines[['top', 'right']].set_visible(False)
        each.grid(color='#eee')
        each.set_axisbelow(True)
    names = [f'{world["map"]}{" *" if world["held_out"] else ""}' for world in worlds]
    axes[0].set_yticks(range(len(names)), names)
    axes[0].set_ylim(len(names) - 0.5, -0.5)
    figure.legend(loc='outside lower center', ncols=len(MENTORS), frameon=False)
    return figure


def _draw(axes: Axes, ratios: Sequence[float], edge: float, color: str, label: str = '') -> None:
    """Draw the ratios of all worlds: 0 for one below it, and a triangle for one beyond an edge."""
    x, rows = np.maximum(ratios, 0.0), np.arange(len(ratios))
    inside, beyond = x <= edge, x > edge
    axes.scatter(x[inside], rows[inside], s=30, color=color, label=label, alpha=0.85)
    axes.scatter(np.full(beyond.sum(), edge), rows[beyond], s=34, color=color, marker='>')
