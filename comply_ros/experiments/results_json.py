# SPDX-License-Identifier: Apache-2.0
"""All numbers of a reproduction, as the table that `results.json` holds."""

from collections.abc import Sequence
from math import isnan

from numpy.typing import NDArray

from comply_ros.experiments.figure_checks import verdict
from comply_ros.experiments.report_figures import all_runs, Figure, Mentors
from comply_ros.experiments.results import Results
from comply_ros.experiments.seed_statistics import band, interval
from comply_ros.experiments.training_runs import mentor_return, reference_returns_of, Run


def numbers_of(results: Results, figures: Sequence[Figure], mentors: Mentors) -> dict:
    """Return the figures with their verdicts, and the cells with curves and measures, by name."""
    cells = {run.cell_name(): _cell_numbers(results, run) for run in all_runs(figures)}
    mazes = {}
    for name in ('maze', 'maze_as_run'):
        reference = reference_returns_of(Run(name, results.profile))
        mazes[name] = {'optimal_return': reference.optimal_return,
                       'random_return': reference.random_return}
    return {
        'profile': results.profile, 'seeds': results.cells.seeds, 'mentor_specs': list(mentors),
        'mazes': mazes,
        'figures': {figure.name: _figure_numbers(results, figure) for figure in figures},
        'cells': cells}


def _figure_numbers(results: Results, figure: Figure) -> dict:
    """Return title, caption, cells, and the verdict where there is one."""
    table = {'title': figure.title, 'showed': figure.caption,
             'cells': [run.cell_name() for run in figure.all_runs()]}
    checked = verdict(results, figure) if figure.is_of_report() else None
    if checked:
        table.update(agrees=bool(checked.agrees), evidence=checked.evidence)
    return table


def _cell_numbers(results: Results, run: Run) -> dict:
    """Return the mean curve, its band, and the measures with their 95 % intervals."""
    counted = results.counted(run)
    low, high = band(counted)
    table = {'mentor_return': mentor_return(run), 'seeds': len(counted),
             'steps': int(results.cell(run).steps.sum()),
             'mean': _rounded(counted.mean(axis=0)), 'low': _rounded(low), 'high': _rounded(high)}
    for name in ('time_to_convergence', 'reward_ratio', 'regret'):
        mean, least, most = interval(results.measured(run, name))
        table[name] = None if isnan(mean) else {'mean': mean, 'low': least, 'high': most}
    return table


def _rounded(values: NDArray) -> list[float]:
    return [round(value, 4) for value in values.tolist()]
