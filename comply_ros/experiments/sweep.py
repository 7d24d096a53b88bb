# SPDX-License-Identifier: Apache-2.0
"""`sweep`: methods x mentors x settings x seeds of a file, in parallel, into one tidy table."""

import argparse
import os
from pathlib import Path
import sys

from comply_ros.experiments.csv_table import Table, TableError
from comply_ros.experiments.executors import cluster, EngineError, MEASURES, outcomes, this_machine
from comply_ros.experiments.sweep_yaml import read_sweep, SweepFileError
from comply_ros.learner.learner_config import ConfigError
from comply_ros.terminal.console import console, progress_bar
from comply_ros.terminal.interrupts import interrupts
from comply_ros.terminal.training_options import MISTAKES

WRONG = (SweepFileError, TableError, *MISTAKES)


def main(argv):
    """Run the command; return the exit code."""
    given = _parser().parse_args(argv[1:])
    try:
        return run(given)
    except (*WRONG, EngineError, OSError, KeyboardInterrupt) as error:
        return _said(error)


def _parser():
    parser = argparse.ArgumentParser('sweep', description='Learn all combinations of methods, '
                                     'mentors, settings and seeds, into one table. What the table '
                                     'has already is not repeated.')
    add = parser.add_argument
    add('file', metavar='FILE.yaml', help='what to combine; config/sweep.yaml is an example')
    add('--out', metavar='FILE.csv', help='(default: runs/FILE.csv)')
    add('--workers', type=int, metavar='N', help='runs at once (default: as many as cores)')
    add('--scheduler', metavar='ADDRESS', help='of a Dask cluster to run on, such as '
        'tcp://10.0.0.1:8786 (default: this machine)')
    return parser


def run(given):
    """Learn what the table does not have yet, and return the exit code."""
    sweep = read_sweep(given.file)
    path = Path(given.out or Path('runs') / f'{Path(given.file).stem}.csv')
    columns = [*sweep.axes, *(name for name in MEASURES if name not in sweep.axes)]
    with interrupts() as stop:
        engine = _engine(given, stop)
        with Table(path, columns) as table:
            return _complete(table, sweep, engine, stop)


def _complete(table, sweep, engine, stop):
    """Change the table: add what is missing; say how far it came, and return the exit code."""
    done = finished(sweep, table)
    before = len(done)
    try:
        if before < len(sweep):
            with engine as opened:
                fill(table, sweep, done, opened, stop)
    except (*WRONG, EngineError, OSError, KeyboardInterrupt) as error:
        return _said(error, f'; {len(done)} of {len(sweep)} runs are kept in {table.path}, and '
                     'the same command goes on from there' if done else '')
    console.print(f'  {table.path}: {len(done)} runs, {len(done) - before} of them new',
                  soft_wrap=True)
    return 0


def _engine(given, stop):
    if given.scheduler is not None:
        if given.workers is not None:
            raise ConfigError('--workers is for this machine, a cluster has its own: leave it or '
                              '--scheduler out')
        return cluster(given.scheduler)
    workers = os.cpu_count() if given.workers is None else given.workers
    if workers < 1:
        raise ConfigError(f'workers must be at least 1, got {workers}')
    return this_machine(workers, stop)


def finished(sweep, table):
    """
    Return the set of the numbers of the runs that a table has.

    Raises
    ------
    TableError: if it has one that is not of the sweep.

    """
    done = set()
    for line, texts in table.rows():
        number = sweep.number_of(texts)
        if number is None:
            values = ', '.join(texts[name] for name in sweep.axes)
            raise TableError(f'{table.path}, line {line}: every run of the table must be one of '
                             f'the sweep, got {values}: give another --out')
        done.add(number)
    return done


def fill(table, sweep, done, engine, stop):
    """Change table and done: add each run that is missing as soon as it has ended."""
    left = ((k, sweep.run(k)) for k in range(len(sweep)) if k not in done)
    with progress_bar() as bar:
        task = bar.add_task('sweep', total=len(sweep), completed=len(done), now=engine.label)
        for number, measured in outcomes(engine, left, stop):
            table.append({**sweep.values_of(number), **measured})
            done.add(number)
            bar.update(task, advance=1)


def _said(error, kept=''):
    """Say in one line why there is no more, and return the exit code."""
    if isinstance(error, KeyboardInterrupt):
        text, code = 'interrupted', 130
    elif isinstance(error, OSError):
        text, code = f'{error.filename}: {(error.strerror or str(error)).lower()}', 1
    else:
        text, code = str(error), 1 if isinstance(error, EngineError) else 2
    print(f'sweep: {text}{kept}', file=sys.stderr)
    return code
