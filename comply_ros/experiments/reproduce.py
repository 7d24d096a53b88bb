# SPDX-License-Identifier: Apache-2.0
"""`reproduce`: every figure of the report, or the suite; computed in parallel, resumed, drawn."""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import fcntl
from pathlib import Path

from comply_ros.experiments import training_runs
from comply_ros.experiments.computed_results import Results
from comply_ros.experiments.extra_curves import EXTRA_CURVES
from comply_ros.experiments.figure_plots import PLOTS
from comply_ros.experiments.figures_beyond_report import extra_figures
from comply_ros.experiments.missing_cells import compute_cells
from comply_ros.experiments.report_figures import all_runs, Figure, Mentors, report_figures
from comply_ros.experiments.report_files import count_verdicts, numbers_of, write_page
from comply_ros.experiments.result_cache import ResultCache
from comply_ros.experiments.suite import run_suite, SuiteError
from comply_ros.learner.presets import METHODS
from comply_ros.mentor.policy_text import format_policy
from comply_ros.plots.grid_plot import write_picture
from comply_ros.storage.file_system import printable
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import read_mentor_spec
from comply_ros.storage.run_files import OutputError, prepare_folder, write_json
from comply_ros.terminal.command_line import CommandParser, whole_number
from comply_ros.terminal.console import console, progress_bar
from comply_ros.terminal.interrupts import check, interrupts
from comply_ros.terminal.training_options import guarded, MISTAKES
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

SEEDS, SUITE_SEEDS = 30, 3


class FigureError(ValueError):
    """A figure that does not exist or cannot be plotted; the message names it."""


def main(argv: Sequence[str]) -> int:
    """Run the command; return the exit code."""
    parser = CommandParser(
        'reproduce', description='Regenerate the figures of the report, and compare them.')
    add = parser.add_argument
    add('--figures', nargs='+', metavar='NAME', help='such as 4.15 4.16 (default: all)')
    add('--suite', action='store_true',
        help='instead of figures: model_based with every mentor, and other methods, in every map '
        'and in random worlds (3 seeds on two cores: about 15 minutes, half of them MountainCar)')
    add('--ablations', action='store_true',
        help='also, with --suite: model_based with one part of it switched off')
    add('--seeds', type=whole_number, metavar='N', help=f'(default: {SEEDS}; of the suite '
        f'{SUITE_SEEDS})')
    add('--profile', default='published', metavar='NAME',
        help=f'{" or ".join(METHODS)} (default: %(default)s)')
    add('--mentors', metavar='DIR', help='a folder with mentor_1.txt (99.9 %%) and mentor_3.txt '
        '(50 %%) to use instead of generated mentors')
    add('--out', metavar='DIR', help='(default: runs/reproduce-PROFILE)')
    add('--redraw', action='store_true', help='plot what was computed, compute nothing')
    add('--page', metavar='FILE', help='also write the page to this file, its pictures beside it')
    options = parser.parse_args(argv[1:])
    if options.seeds is None:
        options.seeds = SUITE_SEEDS if options.suite else SEEDS
    return guarded('reproduce', (*MISTAKES, FigureError, SuiteError), lambda: run(options))


def run(options: argparse.Namespace) -> int:
    """Compute what is missing, plot, compare, write; return the exit code."""
    if options.seeds < 1:
        raise FigureError(f'seeds must be at least 1, got {options.seeds}')
    if options.profile not in METHODS:
        raise FigureError(f'profile must be one of {", ".join(METHODS)}, got {options.profile!r}')
    _check_suite_options(options)
    out = prepare_folder(options.out or Path('runs') / f'reproduce-{options.profile}')
    if options.suite:
        with lock_folder(out):
            return run_suite(options, out)
    json, pages = out / 'results.json', [out / 'results.md']
    if options.page:
        pages.append(Path(options.page))
    with lock_folder(out):
        mentors = _mentors(options, out)
        figures = _chosen_figures(options, mentors)
        results = Results(ResultCache(out / 'data', options.seeds), options.profile)
        _complete(figures, results.cells, options)
        numbers = numbers_of(results, figures, mentors)
        try:
            write_json(json, numbers)
        except OSError as error:
            raise OutputError(
                f'{json} must be writable ({str(error.strerror).lower()})') from None
        _plot(figures, results, out / 'figures')
        for page in pages:
            write_page(page, numbers, figures, out / 'figures')
    agree, count = count_verdicts(numbers)
    if count:
        console.print(f'\n{agree} of {count} figures agree with the report')
    for path in (out / 'figures', json, *pages):
        console.print(f'  {printable(path)}', soft_wrap=True)
    return 0


def _check_suite_options(options: argparse.Namespace) -> None:
    """Raise FigureError for an option that only the suite has, or that it does not have."""
    if options.ablations and not options.suite:
        raise FigureError('--ablations must come with --suite, got it without')
    for name in ('figures', 'mentors'):
        if options.suite and getattr(options, name):
            raise FigureError(f'--{name} must not come with --suite, got both')


@contextmanager
def lock_folder(out: Path) -> Iterator[None]:
    """Lock a folder for one `reproduce`; raise FigureError if another one uses it."""
    with (out / '.lock').open('w') as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise FigureError(f'{out} must be used by one reproduce at a time, and another one '
                              'uses it: wait for it, or choose another --out') from None
        yield


def _mentors(options: argparse.Namespace, out: Path) -> Mentors:
    """
    Return the mentors: generated ones, or those of the folder that was given.

    The optimal one of the published runs was planned with slips that can bump, though in them
    none did: it is planned in `maze`, and written to a file to be used in `maze_as_run`.
    """
    mentors = Mentors()
    if options.profile == 'published':
        world = World(read_map('maze', options.profile))
        path = prepare_folder(out / 'mentors') / 'optimal.txt'
        path.write_text(format_policy(optimal_policy(world), world))
        mentors = mentors._replace(optimal=f'file:{path}')
    if options.mentors:
        folder = Path(options.mentors).expanduser()
        mentors = mentors._replace(good=f'file:{folder / "mentor_1.txt"}',
                                   bad=f'file:{folder / "mentor_3.txt"}')
        for spec in (mentors.good, mentors.bad):
            read_mentor_spec(spec)  # an error if it is missing, even if no figure needs it
    return mentors


def _chosen_figures(options: argparse.Namespace, mentors: Mentors) -> list[Figure]:
    """Return the figures that were asked for; raise FigureError for an unknown name."""
    figures = [*report_figures(options.profile, mentors), *extra_figures(options.profile, mentors)]
    names = [figure.name for figure in figures]
    for name in options.figures or ():
        if name not in names:
            raise FigureError(f'a figure must be one of {", ".join(names)}, got {name!r}')
    return [each for each in figures if not options.figures or each.name in options.figures]


def _complete(
        figures: Sequence[Figure], cache: ResultCache, options: argparse.Namespace) -> None:
    """Add the missing cells to the cache; with `--redraw` raise FigureError instead."""
    runs = all_runs(figures)
    for run in runs:
        training_runs.validate_run(run)
    watched = set(all_runs(figure for figure in figures if figure.kind == 'changes'))
    missing = [run for run in runs if not cache.has(run, run in watched)]
    curves = [(figure.kind, run) for figure in figures for run in figure.extra_runs()
              if not cache.has_extra(figure.kind, run)]
    if options.redraw and (missing or curves):
        raise FigureError(f'--redraw must find all cells with {cache.seeds} seeds in '
                          f'{cache.folder}, but {len(missing) + len(curves)} are missing')
    with interrupts() as stop:
        if missing:
            compute_cells(missing, cache, stop, watched)
        for kind, run in curves:
            check(stop)
            cache.save_extra(kind, run, EXTRA_CURVES[kind](run, cache.seeds))


def _plot(figures: Sequence[Figure], results: Results, folder: Path) -> None:
    """Write the pictures of the figures."""
    prepare_folder(folder)
    plotted = [figure for figure in figures if figure.kind != 'table']
    with interrupts() as stop, progress_bar() as bar:
        task = bar.add_task('drawing', total=len(plotted), now='')
        for figure in plotted:
            check(stop)
            plot = PLOTS[figure.kind](figure, results)
            write_picture(plot, folder / f'{figure.name}.png', dpi=120, compression=9)
            bar.update(task, advance=1, now=figure.name)
