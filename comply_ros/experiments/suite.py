# SPDX-License-Identifier: Apache-2.0
"""`reproduce --suite`: one method in every world with every mentor, as a table and a picture."""

import argparse
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
import shutil

from comply_ros.experiments.computed_results import Results
from comply_ros.experiments.missing_cells import compute_cells
from comply_ros.experiments.result_cache import ResultCache
from comply_ros.experiments.suite_numbers import (
    ablation_numbers,
    count_rule,
    last_returns,
    Numbers,
    world_numbers,
)
from comply_ros.experiments.suite_page import NO_GYMNASIUM, page_lines, TITLE
from comply_ros.experiments.suite_plot import suite_figure
from comply_ros.experiments.suite_runs import ablation_runs, mountain_car_runs, suite_worlds
from comply_ros.experiments.training_runs import Run
from comply_ros.plots.grid_plot import write_picture
from comply_ros.storage.file_system import atomic_write, printable
from comply_ros.storage.run_files import OutputError, prepare_folder, write_json
from comply_ros.terminal.console import console
from comply_ros.terminal.interrupts import interrupts


class SuiteError(ValueError):
    """A page or a cache that the suite cannot use; the message names it."""


def run_suite(options: argparse.Namespace, out: Path) -> int:
    """
    Compute what is missing of the suite, draw and write it to a folder; return the exit code.

    Raises
    ------
    SuiteError: for a page that is another one, or `--redraw` with missing cells.
    OutputError: if something cannot be written.

    """
    page = Path(options.page) if options.page else None
    if page:
        check_page(page)
    worlds, profile = suite_worlds(), options.profile
    made = prepare_folder(out / 'suite')  # the maps and mentors that are written for it
    parts = ablation_runs(profile, made)
    car = mountain_car_runs(profile, made) if find_spec('gymnasium') else None
    results = Results(ResultCache(out / 'data', options.seeds), profile)
    asked = [run for world in worlds for run in world.runs(profile).values()]
    _complete([*asked, *(parts.values() if options.ablations else ()),
               *(car.values() if car else ())], results.cells, options.redraw)
    numbers: Numbers = {
        'profile': profile, 'seeds': options.seeds,
        'worlds': [world_numbers(results, world) for world in worlds],
        'mountain_car': last_returns(results, car) if car else None}
    if all(map(results.cells.has, parts.values())):
        numbers['ablations'] = ablation_numbers(results, parts)
    _write(numbers, out, page)
    return 0


def check_page(page: Path) -> None:
    """Return if a file does not exist or is a page of the suite; raise SuiteError otherwise."""
    if page.exists() and not page.read_text().startswith(TITLE + '\n'):
        raise SuiteError(f'a page of the suite must be a new file, or begin with {TITLE!r}, and '
                         f'{page} is another page, which would be lost')


def _complete(runs: Sequence[Run], cache: ResultCache, redraws: bool) -> None:
    """Add the missing cells to the cache; with `--redraw` raise SuiteError instead."""
    missing = [run for run in dict.fromkeys(runs) if not cache.has(run)]
    if redraws and missing:
        raise SuiteError(f'--redraw must find all cells with {cache.seeds} seeds in '
                         f'{cache.folder}, but {len(missing)} are missing')
    if missing:
        with interrupts() as stop:
            compute_cells(missing, cache, stop)


def _write(numbers: Numbers, out: Path, page: Path | None) -> None:
    """Write numbers, picture and pages, and print where they are and how often each rule holds."""
    worlds, picture = numbers['worlds'], prepare_folder(out / 'figures') / 'suite.png'
    write_picture(suite_figure(worlds), picture, dpi=120, compression=9)
    written = [picture, write_json(out / 'suite.json', numbers)]
    for path in filter(None, (out / 'suite.md', page)):
        written.append(_write_page(path, numbers, picture))
    if numbers['mountain_car'] is None:
        console.print(NO_GYMNASIUM, soft_wrap=True)
    for text, rule in (('with any mentor', 'all'), ('without a mentor', 'alone')):
        console.print('the rule {} holds in {} of {} worlds'.format(
            text, *count_rule(worlds, rule)))
    for path in written:
        console.print(f'  {printable(path)}', soft_wrap=True)


def _write_page(path: Path, numbers: Numbers, picture: Path) -> Path:
    """Write the page, whole or not at all, and return its path; a page elsewhere has a picture."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        name = f'{picture.parent.name}/{picture.name}'
        if picture.parent.parent.resolve() != path.parent.resolve():
            name = path.with_suffix('.png').name
            shutil.copyfile(picture, path.with_name(name))
        with atomic_write(path) as part:
            part.write_text('\n'.join(page_lines(numbers, name)) + '\n')
    except OSError as error:
        raise OutputError(f'a page must be writable, got {str(path)!r} '
                          f'({str(error.strerror).lower()})') from None
    return path
