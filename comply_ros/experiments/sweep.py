# SPDX-License-Identifier: Apache-2.0
"""`sweep`: methods x mentors x settings x seeds of a file, in parallel, into one tidy table."""

import argparse
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from math import isclose
from pathlib import Path
import sys

from comply_ros.experiments import parallel_runs
from comply_ros.experiments.csv_table import CsvTable, TableError
from comply_ros.experiments.parallel_runs import ClusterError, Executor
from comply_ros.experiments.sweep_grid import Sweep
from comply_ros.experiments.sweep_yaml import read_sweep, SweepFileError
from comply_ros.experiments.training_runs import mentor_return, reference_returns_of, Run
from comply_ros.learner.learner_config import ConfigError
from comply_ros.mentor.several_mentors import has_files
from comply_ros.storage.file_system import printable, reason_of
from comply_ros.terminal.command_line import CommandParser, whole_number
from comply_ros.terminal.console import console, progress_bar
from comply_ros.terminal.interrupts import interrupts, StopFlag
from comply_ros.terminal.standard_output import is_closed
from comply_ros.terminal.training_options import MISTAKES

ERRORS = (SweepFileError, TableError, *MISTAKES, ClusterError, OSError, KeyboardInterrupt)


def main(argv: Sequence[str]) -> int:
    """Run the command; return the exit code."""
    parser = CommandParser(
        'sweep', description='Learn all combinations of methods, mentors, settings and seeds, '
        'into one table. Runs that the table has already are not repeated.')
    add = parser.add_argument
    add('file', metavar='FILE.yaml', help='what to combine; config/sweep.yaml is an example')
    add('--out', metavar='FILE.csv', help='(default: runs/FILE.csv)')
    add('--workers', type=whole_number, metavar='N',
        help='runs at once (default: as many as cores that this process may use)')
    add('--scheduler', metavar='ADDRESS', help='of a Dask cluster to run on, such as '
        'tcp://10.0.0.1:8786 (default: this machine)')
    options = parser.parse_args(argv[1:])
    try:
        return run(options)
    except ERRORS as error:
        if isinstance(error, KeyboardInterrupt):
            message, code = 'interrupted', 130
        elif isinstance(error, BrokenPipeError) and is_closed():
            raise
        elif isinstance(error, OSError):
            message, code = f'{error.filename or "output"}: {reason_of(error)}', 1
        else:
            message, code = str(error), getattr(error, 'exit_code', 2)
        print(f'sweep: {message}', *getattr(error, '__notes__', ()), sep='; ', file=sys.stderr)
        return code


def run(options: argparse.Namespace) -> int:
    """Learn the runs that the table lacks; return the exit code."""
    sweep = read_sweep(options.file)
    path = Path(options.out or Path('runs') / f'{Path(options.file).stem}.csv')
    columns = [*sweep.axes,
               *(name for name in parallel_runs.RESULT_COLUMNS if name not in sweep.axes)]
    with interrupts() as stop:
        executor = _executor(options, stop)
        with CsvTable(path, columns) as table:
            done = finished_runs(sweep, table)
            before = len(done)
            try:
                if before < len(sweep):
                    with executor as opened:
                        _fill(table, sweep, done, opened, stop)
            except ERRORS as error:
                if done:
                    error.add_note(f'{len(done)} of {len(sweep)} runs are kept in {table.path}, '
                                   'and the same command continues from there')
                raise
    console.print(f'  {printable(table.path)}: {len(done)} runs, {len(done) - before} of them new',
                  soft_wrap=True)
    for name in maps_without_model(sweep):
        console.print(f'  {printable(name)} has no model: its runs have no '
                      f'{", ".join(parallel_runs.COMPARED_COLUMNS)}', soft_wrap=True, markup=False)
    return 0


def maps_without_model(sweep: Sweep) -> list[str]:
    """Return the maps of a sweep in which nobody knows what an action leads to."""
    profile = sweep.axes['profile'][0]
    return [name for name in sweep.axes['map']
            if reference_returns_of(Run(name, profile)).optimal_return is None]


def _executor(options: argparse.Namespace, stop: StopFlag) -> AbstractContextManager[Executor]:
    if options.scheduler is not None:
        if options.workers is not None:
            raise ConfigError('--workers is for this machine, but a cluster has its own workers: '
                              'leave out --workers or --scheduler')
        return parallel_runs.dask_executor(options.scheduler)
    if options.workers is not None and options.workers < 1:
        raise ConfigError(f'workers must be at least 1, got {options.workers}')
    return parallel_runs.local_executor(parallel_runs.measure, stop, options.workers)


def finished_runs(sweep: Sweep, table: CsvTable) -> set[int]:
    """Return the numbers of the runs in a table; raise TableError if one is not of the sweep."""
    done = set()
    for line, texts in table.rows():
        number = sweep.number_of(texts)
        if number is None:
            values = ', '.join(texts[name] for name in sweep.axes)
            raise TableError(f'{table.path}, line {line}: every run of the table must be one of '
                             f'the sweep, got {values}: choose another --out')
        _check_returns(sweep.run(number), texts, f'{table.path}, line {line}')
        done.add(number)
    return done


def _check_returns(run: Run, texts: Mapping[str, str], place: str) -> None:
    """Raise TableError if a run of a table was with another map or mentor of the same name."""
    expected = {'map': ('optimal_return', reference_returns_of(run).optimal_return)}
    if has_files(run.mentor):  # others are what their names say
        expected['mentor'] = 'mentor_return', mentor_return(run)
    for what, (column, value) in expected.items():
        if value is not None and not isclose(float(texts[column] or 'nan'), value, rel_tol=1e-9):
            raise TableError(f'{place}: the {what} of a run must be that of the sweep, with a '
                             f'{column} of {value:g}, got {texts[column]}: the file was changed; '
                             'choose another --out')


def _fill(table: CsvTable, sweep: Sweep, done: set[int], executor: Executor,
          stop: StopFlag) -> None:
    """Add each missing run to the table and to `done` as soon as it has completed."""
    missing = ((k, sweep.run(k)) for k in range(len(sweep)) if k not in done)
    with progress_bar() as bar:
        task = bar.add_task('sweep', total=len(sweep), completed=len(done), now=executor.label)
        for number, measured in parallel_runs.completed(executor, missing, stop):
            table.append({**sweep.values_of(number), **measured})
            done.add(number)
            bar.update(task, advance=1)
