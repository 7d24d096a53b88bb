# SPDX-License-Identifier: Apache-2.0
"""One plot for each kind of figure: from a `Figure` and the results to a matplotlib figure."""

from collections.abc import Callable
from math import exp, lgamma, log
from typing import Any

from matplotlib.axes import Axes
import matplotlib.figure
from matplotlib.ticker import StrMethodFormatter
import numpy as np
from numpy.typing import NDArray

from comply_ros.experiments.computed_results import Results
from comply_ros.experiments.exchange_plot import plot_exchange
from comply_ros.experiments.line_styles import line_style
from comply_ros.experiments.report_figures import Figure
from comply_ros.experiments.seed_statistics import band, interval
from comply_ros.experiments.training_runs import advice_of, mentor_return, reference_returns_of
from comply_ros.plots.grid_plot import (
    BLUE,
    draw_arrows,
    GREEN,
    grid_figure,
    INK,
    ORANGE,
    RED,
    trust_figure,
)
from comply_ros.plots.running_mean import running_mean
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.planning import optimal_policy, STOP_SHARE, sweeps_until, value_iteration

AXIS_LABELS = {'time_to_convergence': 'time to convergence', 'reward_ratio': 'reward ratio',
               'regrets': 'regret'}

Plot = matplotlib.figure.Figure


def new_plot(
        title: str, x: str, y: str, size: tuple[float, float] = (6.6, 4.0)) -> tuple[Plot, Axes]:
    """Return a plot and its axes, with a title and the labels of the axes."""
    plot = Plot(figsize=size, layout='constrained')
    axes = plot.add_subplot()
    axes.set_title(title, loc='left', fontsize=12, color=INK)
    axes.set_xlabel(x, fontsize=11)
    axes.set_ylabel(y, fontsize=11)
    axes.tick_params(labelsize=10)
    axes.spines[['top', 'right']].set_visible(False)
    axes.grid(color='#eee')
    axes.set_axisbelow(True)
    return plot, axes


def plot_map(figure: Figure, results: Results) -> Plot:
    """Plot the cells of the world."""
    world = results.world(figure.map)
    plot, axes = grid_figure(world, figure.title, size=5.0)
    if len(world.starts) > 16:
        axes.set_xlabel('an episode begins in any free cell')
    return plot


def plot_policy(figure: Figure, results: Results) -> Plot:
    """Plot the arrows of the optimal policy."""
    world = results.world(figure.map)
    plot, axes = grid_figure(world, figure.title, size=8.0 if world.grid.width > 20 else 5.0)
    draw_arrows(axes, world.grid, np.flatnonzero(world.free), optimal_policy(world), color=INK)
    return plot


def plot_advice(figure: Figure, results: Results) -> Plot:
    """Plot the arrows of a mentor; red where they are wrong."""
    run = figure.runs['mentor']
    world, advice, wrong = results.world(figure.map), advice_of(run), results.wrong(run)
    plot, axes = grid_figure(world, f'{figure.title}; red: a step and a half worse than optimal')
    for states, colour in ((world.free & ~wrong, INK), (world.free & wrong, RED)):
        states = np.flatnonzero(states & (advice != NO_ACTION))
        draw_arrows(axes, world.grid, states, advice, color=colour)
    return plot


def plot_sweeps(figure: Figure, results: Results) -> Plot:
    """Plot the largest change of a value in each sweep (2.14), and where (2.23) stops."""
    sweeps = value_iteration(results.world(figure.map))
    changes = [change for _, (_, change) in zip(range(300), sweeps)]
    stop = sweeps_until(STOP_SHARE, changes)
    plot, axes = new_plot(figure.title, 'sweep over all states', 'largest change of a value')
    axes.semilogy(range(1, stop + 11), changes[:stop + 10], color=BLUE, linewidth=2.2)
    axes.axhline(STOP_SHARE * changes[0], color=RED, linestyle='--', linewidth=1.5,
                 label='0.1 % of the first change (2.23)')
    axes.axvline(stop, color=INK, linestyle=':', label=f'stops after {stop} sweeps')
    axes.legend(frameon=False)
    return plot


def plot_changes(figure: Figure, results: Results) -> Plot:
    """Plot the largest change of an action value in each iteration."""
    plot, axes = new_plot(figure.title, 'iteration', 'largest change of an action value')
    for label, run in figure.runs.items():
        _draw_mean(axes, results.cell(run).changes, label, line_style(label))
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False)
    return plot


def plot_curves(figure: Figure, results: Results) -> Plot:
    """Plot the mean return in each iteration, with the optimal and the mentor's return."""
    plot, axes = new_plot(figure.title, 'iteration', 'mean return of an episode')
    runs = list(figure.runs.values())
    optimal = reference_returns_of(runs[0]).optimal_return
    axes.axhline(optimal, color=GREEN, linewidth=1.2, zorder=1, label='optimal')
    mentors = {run.mentor: run for run in runs if run.mentor != 'none'}
    for label, run in figure.runs.items():
        style = line_style(label)
        if len(mentors) > 1 and run.mentor == list(mentors)[0]:
            style['linestyle'] = '-'
        _draw_mean(axes, results.counted(run), label, style)
    lowest = min(float(running_mean(results.counted(run).mean(axis=0)).min()) for run in runs)
    axes.set_ylim(lowest - 0.08 * (optimal - lowest), optimal + 0.06 * (optimal - lowest))
    for run in mentors.values():
        level = mentor_return(run)
        if level is not None and level > lowest:
            axes.axhline(level, color=ORANGE, linewidth=1.2, linestyle=':', zorder=1,
                         label=f'mentor ({level:.2f})')
    axes.legend(frameon=False, fontsize=10, loc='lower right')
    return plot


def _draw_mean(
        axes: Axes, values: NDArray[np.float64], label: str, style: dict[str, Any]) -> None:
    """Draw a mean over seeds with its band from the 10th to the 90th percentile."""
    x = np.arange(1, 1 + values.shape[1])
    low, high = band(values)
    axes.fill_between(x, running_mean(low), running_mean(high), color=style['color'], alpha=0.15,
                      linewidth=0)
    axes.plot(x, running_mean(values.mean(axis=0)), label=label, linewidth=2.0, **style)
    axes.set_xlim(left=1)


def plot_greedy_curve(figure: Figure, results: Results) -> Plot:
    """Plot the return of a learner, and of its greedy policy (3.5), as it learns."""
    run = figure.runs['sarsa']
    numbers, learner, greedy = results.greedy_curve(run)
    plot, axes = new_plot(figure.title, 'iteration', 'return of an episode')
    axes.plot(numbers, learner, label='learner, while it explores', linewidth=2,
              **line_style('sarsa'))
    axes.plot(numbers, greedy, color=INK, linewidth=1, marker='.', markersize=4,
              label='its greedy policy, exactly')
    axes.axhline(reference_returns_of(run).optimal_return, color=GREEN, linewidth=1.2,
                 label='optimal')
    for level in (0.5, 0.75):
        nearest = int(np.argmin(np.abs(np.array(greedy) - results.return_at(run, level))))
        axes.plot(numbers[nearest], greedy[nearest], 's', color=RED, markersize=9,
                  label=f'a mentor of {level:.0%}' if level == 0.5 else None)
    axes.legend(frameon=False, fontsize=10)
    return plot


def plot_together(figure: Figure, results: Results) -> Plot:
    """Plot the mean return of learners that teach each other, and of the same ones alone."""
    plot, axes = new_plot(figure.title, 'iteration', 'mean return of an episode')
    run = next(iter(figure.runs.values()))
    axes.axhline(reference_returns_of(run).optimal_return, color=GREEN, linewidth=1.2, zorder=1,
                 label='optimal')
    for label, run in figure.runs.items():
        colour = line_style(label)['color']
        for values, name, dash in ((results.counted_together(run), 'two together', '-'),
                                   (results.counted(run), 'alone', '--')):
            _draw_mean(axes, values, f'{label}, {name}', {'color': colour, 'linestyle': dash})
    axes.legend(frameon=False, fontsize=10, loc='lower right')
    return plot


def plot_densities(figure: Figure, results: Results) -> Plot:
    """Plot the density of Beta(alpha, beta), among them the prior of the published runs."""
    plot, axes = new_plot(figure.title, 'p', 'density', size=(6.6, 3.6))
    x = np.linspace(0.002, 0.998, 499)
    pairs = ((0.5, 0.055), (1.0, 1.0), (2.0, 2.0), (2.0, 5.0), (8.0, 2.0), (80.0, 20.0))
    for (a, b), colour in zip(pairs, (RED, INK, '#7f7f7f', ORANGE, BLUE, GREEN)):
        scale = lgamma(a + b) - lgamma(a) - lgamma(b)
        density = [exp(scale + (a - 1) * log(p) + (b - 1) * log(1 - p)) for p in x.tolist()]
        axes.plot(x, density, color=colour, linewidth=2, label=f'alpha {a:g}, beta {b:g}')
    axes.set_ylim(0, 10.5)
    axes.legend(frameon=False, fontsize=10)
    return plot


def plot_histogram(figure: Figure, results: Results) -> Plot:
    """Plot how many of the visited states have which confidence in their advice."""
    (label, run), = figure.runs.items()
    values = results.visited_confidence(run)
    plot, axes = new_plot(figure.title, 'confidence in the advice', 'share of the states',
                          size=(6.6, 3.6))
    axes.hist(values, bins=20, range=(0, 1), weights=np.full(len(values), 1 / len(values)),
              color=line_style(label)['color'])
    axes.set_xlim(0, 1)
    return plot


def plot_trust(figure: Figure, results: Results) -> Plot:
    """Plot the arrows of the mentor, coloured by the confidence in them."""
    (run,) = figure.runs.values()
    world, cell = results.world(figure.map), results.cell(run)
    return trust_figure(world, figure.title, advice_of(run), cell.confidence, cell.visited)


def plot_metric(figure: Figure, results: Results) -> Plot:
    """Plot a metric along an axis; learners without a tick on it as horizontal lines."""
    name = 'regret' if figure.kind == 'regrets' else figure.kind
    plot, axes = new_plot(figure.title, figure.axis, AXIS_LABELS[figure.kind], size=(7.6, 4.4))
    ticks = list(dict.fromkeys(tick for _, tick in figure.runs if tick is not None))
    for line in dict.fromkeys(line for line, _ in figure.runs):
        style = line_style(line)
        if (line, None) in figure.runs:
            mean, low, high = interval(results.measured(figure.runs[line, None], name))
            axes.axhline(mean, label=line, linewidth=1.8, **style)
            axes.axhspan(low, high, color=style['color'], alpha=0.12, linewidth=0)
            continue
        points = [(ticks.index(tick), *interval(results.measured(run, name)))
                  for (other, tick), run in figure.runs.items() if other == line]
        x, mean, low, high = np.array(points, dtype=float).T
        axes.plot(x, mean, label=line, marker='o', linewidth=2, **style)
        axes.errorbar(x, mean, (mean - low, high - mean), capsize=4, linestyle='none',
                      color=style['color'])
    axes.set_xticks(range(len(ticks)), [str(tick) for tick in ticks])
    if figure.kind == 'regrets':
        _scale_regret_axis(axes)
    many = len(axes.get_legend_handles_labels()[1]) > 6
    place: dict[str, Any] = {'loc': 'center left', 'bbox_to_anchor': (1.0, 0.5)} if many else {}
    axes.legend(frameon=False, fontsize=10, handlelength=3.2, **place)
    return plot


def _scale_regret_axis(axes: Axes) -> None:
    """Start the axis at 0; above 100 it is logarithmic where the values differ much."""
    if axes.get_ylim()[1] > 1000:
        axes.set_yscale('symlog', linthresh=100)
        axes.set_yticks([0, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000])
        axes.yaxis.set_major_formatter(StrMethodFormatter('{x:.0f}'))
        axes.set_ylabel('regret (logarithmic above 100)', fontsize=11)
    axes.set_ylim(bottom=min(0, axes.dataLim.y0) - 5)


PLOTS: dict[str, Callable[[Figure, Results], Plot]] = {
    'map': plot_map, 'policy': plot_policy, 'advice': plot_advice, 'sweeps': plot_sweeps,
    'changes': plot_changes, 'curves': plot_curves, 'growth': plot_greedy_curve,
    'together': plot_together, 'exchange': plot_exchange,
    'densities': plot_densities, 'histogram': plot_histogram, 'trust': plot_trust,
    'time_to_convergence': plot_metric, 'reward_ratio': plot_metric, 'regrets': plot_metric}
