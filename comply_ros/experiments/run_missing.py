# SPDX-License-Identifier: Apache-2.0
"""What figures need is computed here: on all cores, kept as soon as it is done, resumed."""

from concurrent.futures import as_completed, ThreadPoolExecutor
import os

from comply_ros.experiments import training_runs
from comply_ros.terminal.console import console, progress_bar
from comply_ros.terminal.interrupts import check, interrupts


class FigureError(ValueError):
    """A figure that there is not, or that cannot be drawn; the message names it."""


def complete(figures, cells, redraw, out):
    """
    Compute the cells that are missing.

    Raises
    ------
    FigureError: if some are, and nothing is to be computed.

    """
    watched = {each for figure in figures if figure.kind == 'changes'
               for each in figure.all_runs()}
    missing = [each for each in runs_of(figures) if not cells.has(each, each in watched)]
    grown = [each for figure in figures for each in figure.grown() if not cells.has_growth(each)]
    if redraw and missing + grown:
        raise FigureError(f'{out} must have been computed to be drawn again with {cells.seeds} '
                          f'seeds, but lacks {len(missing + grown)} of its cells')
    with interrupts() as stop, progress_bar() as bar:
        compute(missing, watched, cells, stop, bar)
        for each in grown:
            check(stop)
            cells.save_growth(each, training_runs.growth(each))


def runs_of(figures):
    """List of all different runs of the figures, in their order; each is checked."""
    every = dict.fromkeys(each for figure in figures for each in figure.all_runs())
    for each in every:
        training_runs.check_run(each)
    return list(every)


def compute(missing, watched, cells, stop, bar):
    """Fill the missing cells, on all cores; a cell is kept as soon as its seeds are done."""
    if not missing:
        return
    task = bar.add_task('learning', total=len(missing) * cells.seeds, now='')
    learned = {each: {} for each in missing}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = {pool.submit(training_runs.learn, each._replace(seed=seed), stop, each in watched):
                (each, seed)
                for each in missing for seed in range(cells.seeds)}
        try:
            for job in as_completed(jobs):
                each, seed = jobs.pop(job)
                learned[each][seed] = job.result()
                check(stop)
                if len(learned[each]) == cells.seeds:
                    done = learned.pop(each)
                    cells.save(each, [done[number] for number in range(cells.seeds)])
                bar.update(task, advance=1, now=each.method)
        except BaseException:
            stop.set()
            pool.shutdown(cancel_futures=True)
            console.print(f'{sum(map(cells.has, missing))} of {len(missing)} cells were computed '
                          f'and are kept in {cells.folder}; the same command goes on from there')
            raise
