# SPDX-License-Identifier: Apache-2.0
"""All numbers of a reproduction, as the table that `results.json` holds."""

from math import isnan

from comply_ros.experiments import training_runs
from comply_ros.experiments.figure_checks import verdict
from comply_ros.experiments.seed_statistics import band, interval
from comply_ros.experiments.training_runs import PUBLISHED_MAZES, Run

MEASURES = ('time_to_convergence', 'reward_ratio', 'regret')


def numbers_of(results, figures, mentors):
    """
    Table of the figures with their verdicts, and of the cells with curves and measures.

    mentors: the `Mentors` that stand in it.
    """
    cells = {}
    for figure in figures:
        for run in figure.all_runs():
            cells.setdefault(name_of(run), cell_numbers(results, run))
    return {
        'profile': results.profile, 'seeds': results.cells.seeds,
        'mentor_specs': list(mentors),
        'mazes': {name: maze_numbers(Run(name, results.profile)) for name in PUBLISHED_MAZES},
        'figures': {figure.name: figure_numbers(results, figure) for figure in figures},
        'cells': cells}


def maze_numbers(run):
    """Exact expected returns of the optimal and of the random policy."""
    reference = training_runs.yardstick_of(run)
    return {'optimal_return': reference.optimal_return, 'random_return': reference.random_return}


def name_of(run):
    """Name of a cell: what was run, without the seed."""
    settings = [f'{name}={value}' for name, value in run.settings]
    parts = [run.map, run.profile, run.method, *settings]
    if run.mentor != 'none':
        parts.append(f'mentor {run.mentor}')
    if run.mentor_seed:
        parts.append(f'mentor seed {run.mentor_seed}')
    if run.budget:
        parts.append(f'budget {run.budget} {run.advising}')
    return ', '.join(parts)


def figure_numbers(results, figure):
    """Title, what the report's shows, the cells, and the verdict where there is one."""
    table = {'title': figure.title, 'showed': figure.showed,
             'cells': [name_of(run) for run in figure.all_runs()]}
    judged = verdict(results, figure) if figure.name[0].isdigit() else None
    if judged:
        table.update(agrees=bool(judged.agrees), evidence=judged.evidence)
    return table


def cell_numbers(results, run):
    """Mean curve, its band, and the measures with their 95 % intervals."""
    counted = results.counted(run)
    low, high = band(counted)
    table = {'mentor_return': training_runs.mentor_return(run), 'seeds': len(counted),
             'steps': int(results.cell(run).steps.sum()),
             'mean': _short(counted.mean(axis=0)), 'low': _short(low), 'high': _short(high)}
    for name in MEASURES:
        mean, least, most = interval(results.measured(run, name))
        table[name] = None if isnan(mean) else {'mean': mean, 'low': least, 'high': most}
    return table


def _short(values):
    return [round(value, 4) for value in values.tolist()]
