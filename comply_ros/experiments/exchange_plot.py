# SPDX-License-Identifier: Apache-2.0
"""The plot of mentors that are exchanged half way: confidence and return, with their intervals."""

from typing import Any

from matplotlib.axes import Axes
import matplotlib.figure
import numpy as np
from numpy.typing import NDArray

from comply_ros.experiments.computed_results import Results
from comply_ros.experiments.line_styles import line_style
from comply_ros.experiments.report_figures import Figure
from comply_ros.experiments.seed_statistics import interval
from comply_ros.plots.grid_plot import INK
from comply_ros.plots.running_mean import running_mean

LOWEST = -45.0  # of the axis of returns: below it a curve leaves the picture
ROWS = (('confidences', 'confidence in the advice'), ('returns', 'mean return of an episode'))


def plot_exchange(figure: Figure, results: Results) -> matplotlib.figure.Figure:
    """
    Plot mean confidence and mean return of each method, a column for each order of the mentors.

    A band is the 95 % interval of the mean over the seeds.
    """
    columns = list(dict.fromkeys(mentors for _, mentors in figure.runs))
    plot = matplotlib.figure.Figure(figsize=(5.2 * len(columns), 7.2), layout='constrained')
    all_axes: Any = plot.subplots(2, len(columns), sharex=True, sharey='row', squeeze=False)
    for (method, mentors), run in figure.runs.items():
        curves, column = results.exchange(run), columns.index(mentors)
        for (name, _), axes in zip(ROWS, all_axes[:, column]):
            _draw_halves(axes, getattr(curves, name), curves.exchanged, method)
            axes.axvline(curves.exchanged + 0.5, color=INK, linestyle=':', linewidth=1.2)
    for (_, label), row in zip(ROWS, all_axes):
        row[0].set_ylabel(label, fontsize=11)
        for axes in row:
            axes.spines[['top', 'right']].set_visible(False)
            axes.grid(color='#eee')
            axes.set_axisbelow(True)
    for mentors, axes in zip(columns, all_axes[0]):
        axes.set_title(mentors, loc='left', fontsize=12, color=INK)
    all_axes[0, 0].set_ylim(0, 1.02)
    bottom = all_axes[1, 0]
    bottom.set_ylim(max(LOWEST, bottom.get_ylim()[0]), 8)
    for axes in all_axes[1]:
        axes.set_xlabel('iteration', fontsize=11)
        axes.set_xlim(left=1)
    plot.legend(*bottom.get_legend_handles_labels(), loc='outside lower center', ncols=3,
                frameon=False, fontsize=10)
    return plot


def _draw_halves(axes: Axes, values: NDArray[np.float64], exchanged: int, method: str) -> None:
    """Draw the mean over the seeds of each half, smoothed within it, and its 95 % interval."""
    style = line_style(method)
    for half, start, label in ((values[:, :exchanged], 1, method),
                               (values[:, exchanged:], exchanged + 1, None)):
        x = np.arange(start, start + half.shape[1])
        mean, low, high = (running_mean(each) for each in zip(*map(interval, half.T.tolist())))
        axes.fill_between(x, low, high, color=style['color'], alpha=0.15, linewidth=0)
        axes.plot(x, mean, label=label, linewidth=1.8, **style)
