# SPDX-License-Identifier: Apache-2.0
"""`reproduce`: every figure of the report, computed in parallel, resumed, drawn, compared."""

import argparse
from contextlib import contextmanager
import fcntl
from pathlib import Path

from comply_ros.experiments.extra_figures import own_figures
from comply_ros.experiments.figure_plots import DRAWINGS
from comply_ros.experiments.plot_style import save
from comply_ros.experiments.report_figures import Mentors, report_figures
from comply_ros.experiments.report_markdown import write_page
from comply_ros.experiments.result_cache import Cells
from comply_ros.experiments.results import Results
from comply_ros.experiments.results_json import numbers_of
from comply_ros.experiments.run_missing import complete, FigureError
from comply_ros.learner.presets import METHODS
from comply_ros.mentor.policy_text import format_policy
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import read_mentor_spec
from comply_ros.storage.run_files import OutputError, prepare_folder, write_json
from comply_ros.terminal.console import console, progress_bar
from comply_ros.terminal.interrupts import check, interrupts
from comply_ros.terminal.training_options import guarded, MISTAKES
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy


def main(argv):
    """Run the command; return the exit code."""
    parser = argparse.ArgumentParser(
        'reproduce', description='Regenerate the figures of the report, and compare them.')
    add = parser.add_argument
    add('--figures', nargs='+', metavar='NAME', help='such as 4.15 4.16 (default: all)')
    add('--seeds', type=int, default=30, metavar='N', help='(default: %(default)s)')
    add('--profile', default='published', metavar='NAME',
        help=f'{" or ".join(METHODS)} (default: %(default)s)')
    add('--mentors', metavar='DIR', help='a folder with mentor_1.txt (99.9 %%) and mentor_3.txt '
        '(50 %%) to use instead of generated mentors')
    add('--out', metavar='DIR', help='(default: runs/reproduce-PROFILE)')
    add('--redraw', action='store_true', help='draw again what is there, without computing')
    add('--page', metavar='FILE', help='write the page there too, its pictures beside it')
    given = parser.parse_args(argv[1:])
    return guarded('reproduce', (*MISTAKES, FigureError), lambda: run(given))


def run(given):
    """Compute what is missing, draw, compare, write; return the exit code."""
    if given.seeds < 1:
        raise FigureError(f'seeds must be at least 1, got {given.seeds}')
    if given.profile not in METHODS:
        raise FigureError(f'profile must be one of {", ".join(METHODS)}, got {given.profile!r}')
    out = prepare_folder(given.out or Path('runs') / f'reproduce-{given.profile}')
    with held(out):
        mentors = mentors_of(given, out)
        figures = chosen(given, mentors)
        results = Results(Cells(out / 'data', given.seeds), given.profile)
        complete(figures, results.cells, given.redraw, out)
        numbers = numbers_of(results, figures, mentors)
        write_results(out / 'results.json', numbers)
        pages = [out / 'results.md'] + ([Path(given.page)] if given.page else [])
        with interrupts() as stop, progress_bar() as bar:
            draw(figures, results, out, stop, bar)
        for page in pages:
            write_page(page, numbers, figures, out / 'figures')
    tell(numbers, out, pages)
    return 0


@contextmanager
def held(out):
    """
    Hold a folder for one `reproduce`.

    Raises
    ------
    FigureError: if another one is at work in it.

    """
    with (out / '.lock').open('w') as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise FigureError(f'{out} must have one reproduce at work, and another one is: wait '
                              'for it, or give another --out') from None
        yield


def mentors_of(given, out):
    """
    Return the `Mentors`: generated ones, or those of the folder that was given.

    The optimal one of the published runs was planned with slips that can bump, though in them
    none did: it is planned in `maze`, and written to a file to be used in `maze_as_run`.
    """
    mentors = Mentors()
    if given.profile == 'published':
        world = World(read_map('maze', given.profile))
        path = prepare_folder(out / 'mentors') / 'optimal.txt'
        path.write_text(format_policy(optimal_policy(world), world))
        mentors = mentors._replace(optimal=f'file:{path}')
    if given.mentors:
        folder = Path(given.mentors).expanduser()
        mentors = mentors._replace(good=f'file:{folder / "mentor_1.txt"}',
                                   bad=f'file:{folder / "mentor_3.txt"}')
        for spec in (mentors.good, mentors.bad):
            read_mentor_spec(spec)  # they must be there, whatever is drawn
    return mentors


def chosen(given, mentors):
    """
    List of the figures that were asked for.

    Raises
    ------
    FigureError: for a name that no figure has.

    """
    figures = report_figures(given.profile, mentors) + own_figures(given.profile, mentors)
    names = [figure.name for figure in figures]
    for name in given.figures or ():
        if name not in names:
            raise FigureError(f'a figure must be one of {", ".join(names)}, got {name!r}')
    return [each for each in figures if not given.figures or each.name in given.figures]


def draw(figures, results, out, stop, bar):
    """Draw the figures into the folder."""
    folder = prepare_folder(out / 'figures')
    task = bar.add_task(
        'drawing', total=sum(each.kind != 'table' for each in figures), now='')
    for figure in figures:
        check(stop)
        if figure.kind == 'table':
            continue
        save(DRAWINGS[figure.kind](figure, results), folder / f'{figure.name}.png')
        bar.update(task, advance=1, now=figure.name)


def write_results(path, numbers):
    """Write the numbers; raises OutputError if that cannot be."""
    try:
        write_json(path, numbers)
    except OSError as error:
        raise OutputError(f'{path} must be writable ({error.strerror.lower()})') from None


def tell(numbers, out, pages):
    """Print how many figures agree, and where everything is."""
    verdicts = [each['agrees'] for each in numbers['figures'].values() if 'agrees' in each]
    if verdicts:
        console.print(f'\n{sum(verdicts)} of {len(verdicts)} figures agree with the report')
    for path in (out / 'figures', out / 'results.json', *pages):
        console.print(f'  {path}', soft_wrap=True)
