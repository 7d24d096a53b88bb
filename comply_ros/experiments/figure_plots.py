# SPDX-License-Identifier: Apache-2.0
"""One drawing for each kind of figure: from a `Figure` and its data to a matplotlib figure."""

from math import exp, lgamma, log

from matplotlib.ticker import StrMethodFormatter
import numpy as np

from comply_ros.experiments.plot_style import look_of, new_figure
from comply_ros.experiments.seed_statistics import band, interval, LEVEL_NAMES
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

LABELS = {'time_to_convergence': 'time to convergence', 'reward_ratio': 'reward ratio',
          'regrets': 'regret'}
MOST_SWEEPS = 300


def draw_map(figure, data):
    """Draw the cells of the world."""
    drawn, axes = grid_figure(data.world(figure.grid), figure.title, size=5.0)
    if len(data.world(figure.grid).starts) > 16:
        axes.set_xlabel('an episode begins in any free cell')
    return drawn


def draw_policy(figure, data):
    """Draw the arrows of the optimal policy."""
    world = data.world(figure.grid)
    drawn, axes = grid_figure(world, figure.title, size=8.0 if world.grid.width > 20 else 5.0)
    draw_arrows(axes, world.grid, np.flatnonzero(world.free), optimal_policy(world), color=INK)
    return drawn


def draw_advice(figure, data):
    """Draw the arrows of a mentor; red where they are wrong."""
    world, advice = data.world(figure.grid), data.advice(figure.runs['mentor'])
    drawn, axes = grid_figure(world, f'{figure.title}; red: a step and a half worse than optimal')
    wrong = data.wrong(figure.runs['mentor'])
    for states, colour in ((world.free & ~wrong, INK), (world.free & wrong, RED)):
        states = np.flatnonzero(states & (advice != NO_ACTION))
        draw_arrows(axes, world.grid, states, advice, color=colour)
    return drawn


def draw_sweeps(figure, data):
    """Draw the largest change of a value in each sweep (2.14), and where (2.23) stops."""
    sweeps = value_iteration(data.world(figure.grid))
    changes = [change for _, (_, change) in zip(range(MOST_SWEEPS), sweeps)]
    stop = sweeps_until(STOP_SHARE, changes)
    drawn, axes = new_figure(figure.title, 'sweep over all states', 'largest change of a value')
    axes.semilogy(range(1, stop + 11), changes[:stop + 10], color=BLUE, linewidth=2.2)
    axes.axhline(STOP_SHARE * changes[0], color=RED, linestyle='--', linewidth=1.5,
                 label='0.1 % of the first change (2.23)')
    axes.axvline(stop, color=INK, linestyle=':', label=f'stops after {stop} sweeps')
    axes.legend(frameon=False)
    return drawn


def draw_changes(figure, data):
    """Draw the largest change of an action value in each iteration."""
    drawn, axes = new_figure(figure.title, 'iteration', 'largest change of an action value')
    for label, run in figure.runs.items():
        _line(axes, data.cell(run).changes, look_of(label), label, 1)
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False)
    return drawn


def draw_curves(figure, data):
    """Draw the mean return in each iteration, with the optimal and the mentor's level."""
    drawn, axes = new_figure(figure.title, 'iteration', 'mean return of an episode')
    first = next(iter(figure.runs.values()))
    axes.axhline(data.optimal_return(first), color=GREEN, linewidth=1.2, zorder=1,
                 label='optimal')
    mentors = {run.mentor: run for run in figure.runs.values() if run.mentor != 'none'}
    for label, run in figure.runs.items():
        look = look_of(label)
        if len(mentors) > 1 and run.mentor == list(mentors)[0]:
            look['linestyle'] = '-'
        _line(axes, data.counted(run), look, label, 1)
    lowest = _ends(axes, [data.counted(run) for run in figure.runs.values()],
                   data.optimal_return(first))
    for run in mentors.values():
        level = data.mentor_return(run)
        if level > lowest:
            axes.axhline(level, color=ORANGE, linewidth=1.2, linestyle=':', zorder=1,
                         label=f'mentor ({level:.2f})')
    axes.legend(frameon=False, fontsize=10, loc='lower right')
    return drawn


def _line(axes, values, look, label, first):
    """Draw a mean over seeds with its band from the 10th to the 90th percentile."""
    x = np.arange(first, first + values.shape[1])
    low, high = band(values)
    axes.fill_between(x, running_mean(low), running_mean(high), color=look['color'], alpha=0.15,
                      linewidth=0)
    axes.plot(x, running_mean(values.mean(axis=0)), label=label, linewidth=2.0, **look)
    axes.set_xlim(left=1)


def _ends(axes, curves, highest):
    """Set the ends of the y axis, from the lowest mean to the optimal return; return the low."""
    low = min(float(running_mean(each.mean(axis=0)).min()) for each in curves)
    axes.set_ylim(low - 0.08 * (highest - low), highest + 0.06 * (highest - low))
    return low


def draw_growth(figure, data):
    """Draw the return of a learner, and of its greedy policy (3.5), as it learns."""
    run = figure.runs['sarsa']
    numbers, learner, greedy = data.growth(run)
    drawn, axes = new_figure(figure.title, 'iteration', 'return of an episode')
    axes.plot(numbers, learner, label='learner, while it explores', linewidth=2,
              **look_of('sarsa'))
    axes.plot(numbers, greedy, color=INK, linewidth=1, marker='.', markersize=4,
              label='its greedy policy, exactly')
    axes.axhline(data.optimal_return(run), color=GREEN, linewidth=1.2, label='optimal')
    for level in (0.5, 0.75):
        wanted = data.return_at(run, level)
        nearest = int(np.argmin(np.abs(np.array(greedy) - wanted)))
        axes.plot(numbers[nearest], greedy[nearest], 's', color=RED, markersize=9,
                  label=f'a mentor of {level:.0%}' if level == 0.5 else None)
    axes.legend(frameon=False, fontsize=10)
    return drawn


def draw_densities(figure, data):
    """Draw the density of Beta(alpha, beta), among them the prior of the published runs."""
    drawn, axes = new_figure(figure.title, 'p', 'density', size=(6.6, 3.6))
    x = np.linspace(0.002, 0.998, 499)
    pairs = ((0.5, 0.055), (1.0, 1.0), (2.0, 2.0), (2.0, 5.0), (8.0, 2.0), (80.0, 20.0))
    for (a, b), colour in zip(pairs, (RED, INK, '#7f7f7f', ORANGE, BLUE, GREEN)):
        scale = lgamma(a + b) - lgamma(a) - lgamma(b)
        density = [exp(scale + (a - 1) * log(p) + (b - 1) * log(1 - p)) for p in x.tolist()]
        axes.plot(x, density, color=colour, linewidth=2, label=f'alpha {a:g}, beta {b:g}')
    axes.set_ylim(0, 10.5)
    axes.legend(frameon=False, fontsize=10)
    return drawn


def draw_histogram(figure, data):
    """Draw how many of the visited states have which confidence in their advice."""
    (label, run), = figure.runs.items()
    values = data.trusted(run)
    drawn, axes = new_figure(figure.title, 'confidence in the advice', 'share of the states',
                             size=(6.6, 3.6))
    axes.hist(values, bins=20, range=(0, 1), weights=np.full(len(values), 1 / len(values)),
              color=look_of(label)['color'])
    axes.set_xlim(0, 1)
    return drawn


def draw_trust_map(figure, data):
    """Draw the arrows of the mentor, green where the learner listens, red where it does not."""
    (_, run), = figure.runs.items()
    world, cell = data.world(figure.grid), data.cell(run)
    return trust_figure(world, figure.title, data.advice(run), cell.confidence, cell.visited)


def draw_metric(figure, data):
    """Draw a metric along an axis; learners without a place on it as horizontal lines."""
    name = 'regret' if figure.kind == 'regrets' else figure.kind
    drawn, axes = new_figure(figure.title, figure.axis, LABELS[figure.kind],
                             size=(7.6, 4.4))
    places = list(dict.fromkeys(place for _, place in figure.runs if place is not None))
    for line in dict.fromkeys(line for line, _ in figure.runs):
        look = look_of(line)
        if (line, None) in figure.runs:
            mean, low, high = interval(data.measured(figure.runs[line, None], name))
            axes.axhline(mean, label=line, linewidth=1.8, **look)
            axes.axhspan(low, high, color=look['color'], alpha=0.12, linewidth=0)
            continue
        points = [(places.index(place), *interval(data.measured(run, name)))
                  for (other, place), run in figure.runs.items() if other == line]
        x, mean, low, high = np.array(points, dtype=float).T
        axes.plot(x, mean, label=line, marker='o', linewidth=2, **look)
        axes.errorbar(x, mean, (mean - low, high - mean), capsize=4, linestyle='none',
                      color=look['color'])
    axes.set_xticks(range(len(places)), [LEVEL_NAMES.get(each, str(each)) for each in places])
    if figure.kind == 'regrets':
        _regret_axis(axes)
    many = len(axes.get_legend_handles_labels()[1]) > 6
    axes.legend(frameon=False, fontsize=10, handlelength=3.2, **(
        {'loc': 'center left', 'bbox_to_anchor': (1.0, 0.5)} if many else {}))
    return drawn


def _regret_axis(axes):
    """Begin the axis at 0; above 100 it is logarithmic where the values differ much."""
    if axes.get_ylim()[1] > 1000:
        axes.set_yscale('symlog', linthresh=100)
        axes.set_yticks([0, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000])
        axes.yaxis.set_major_formatter(StrMethodFormatter('{x:.0f}'))
        axes.set_ylabel('regret (logarithmic above 100)', fontsize=11)
    axes.set_ylim(bottom=min(0, axes.dataLim.y0) - 5)


DRAWINGS = {
    'map': draw_map, 'policy': draw_policy, 'advice': draw_advice, 'sweeps': draw_sweeps,
    'changes': draw_changes, 'curves': draw_curves, 'growth': draw_growth,
    'densities': draw_densities, 'histogram': draw_histogram, 'trust': draw_trust_map,
    'time_to_convergence': draw_metric, 'reward_ratio': draw_metric, 'regrets': draw_metric}
