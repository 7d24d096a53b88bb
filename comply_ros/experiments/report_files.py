# SPDX-License-Identifier: Apache-2.0
"""The files of a reproduction: `results.json` with all numbers, and the page of results."""

from collections.abc import Iterator, Sequence
from math import isnan
from pathlib import Path
import shutil

from comply_ros.experiments.computed_results import exchange_ends, Results
from comply_ros.experiments.figure_checks import verdict
from comply_ros.experiments.report_figures import all_runs, Figure, Mentors
from comply_ros.experiments.report_tables import table_lines
from comply_ros.experiments.seed_statistics import band, interval
from comply_ros.experiments.training_runs import mentor_return, reference_returns_of, Run
from comply_ros.storage.file_system import atomic_write
from comply_ros.storage.run_files import OutputError

INTRODUCTION = """# Results

Written by `{command}`; the command computes its measured numbers and every "agrees". Published
numbers are means of 5 runs a cell. Profile `{profile}`, {seeds} seeds a cell. {agree} of {all}
figures agree with those of the report. Curves are means over the seeds, smoothed over a few
iterations, with a band from the 10th to the 90th percentile; numbers behind "±" are half of a
95 % interval (Student's t over the seeds). Trust maps and histograms show the learner with
seed 0; maps and densities are definitions and not counted. The metrics:

* **T**, time to convergence: in profile `published` the number of iterations at or below 4.9,
  where the optimal policy has 5.84; in `report` the iteration after which the return stays above
  99 % of the optimal one.
* **ratio**: the return collected in the first T iterations, over the optimal policy's; the mean
  over the seeds with a T above 0.
* **regret**: the sum over the first 399 iterations of what is missing to the optimal return.

"Optimal" is the exact return of the world's best policy. In profile `published`, T, ratio and
regret are relative to 5.8386, the optimal return as those runs measured it. There the mentor
"optimal" is the policy that those runs planned: for slips that can bump into obstacles, although
no slip did in them.
"""
DIFFERENCES = """
## Where the text and the published runs differ

Both are available as profiles: `--profile report` does what the text says, `--profile published`
what the runs behind its figures did.

| point | `report` | `published` |
|---|---|---|
| obstacle reward in `maze` | -10 | -5 |
| Beta belief (4.2) | the raw difference delta | its sign |
| alpha and beta | unbounded, so the rate is 0.3: larger rates diverge | cut at 0 |
| explicit compliance (3.12) | both values at every step | only the value of what was done |
| p of vanishing compliance | the temperature falls from the start | only once p is below 0.5 |
| learning rate (2.26) | a0 / c^0.55, every visit counts 1 | a0 / c^e, by method |
| softmax | temperature to 0 | never below 0.03 |
| first iteration | learns | only measures, and is not counted |
| time to convergence | the return stays above 99 % | iterations at or below 4.9 |

In both profiles, a learner with constant or vanishing compliance that does not follow a
recommendation may still choose the same action itself (section 3.4.1); the others may not (3.7).
"""


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
    if figure.kind == 'together':
        table['ends'] = {label: results.ends_together(run)._asdict()
                         for label, run in figure.runs.items()}
    if figure.kind == 'exchange':
        table['exchanges'] = [_exchange_numbers(results, *label, run)
                              for label, run in figure.runs.items()]
    checked = verdict(results, figure) if figure.is_of_report() else None
    if checked:
        table.update(agrees=bool(checked.agrees), evidence=checked.evidence)
    return table


def _exchange_numbers(results: Results, method: str, mentors: str, run: Run) -> dict:
    """Return mean confidence and mean return before and after the exchange of a mentor."""
    curves = results.exchange(run)
    return {'method': method, 'mentors': mentors, **{
        name: exchange_ends(values, curves.exchanged)._asdict()
        for name, values in (('confidence', curves.confidences), ('return', curves.returns))}}


def _cell_numbers(results: Results, run: Run) -> dict:
    """Return the mean curve, its band, and the measures with their 95 % intervals."""
    counted = results.counted(run)
    low, high = band(counted)
    table = {'mentor_return': mentor_return(run), 'seeds': len(counted),
             'steps': int(results.cell(run).steps.sum()),
             **{name: [round(value, 4) for value in curve.tolist()] for name, curve in (
                 ('mean', counted.mean(axis=0)), ('low', low), ('high', high))}}
    for name in ('time_to_convergence', 'reward_ratio', 'regret'):
        mean, least, most = interval(results.measured(run, name))
        table[name] = None if isnan(mean) else {'mean': mean, 'low': least, 'high': most}
    return table


def write_page(path: Path, numbers: dict, figures: Sequence[Figure], pictures: Path) -> None:
    """
    Write the page to a Markdown file, whole or not at all; raise OutputError if that fails.

    path: of the file. numbers: as in `results.json`. pictures: folder of the plotted figures; one
    that is elsewhere is copied to a folder beside the page that has the page's name.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if pictures.parent.resolve() != path.parent.resolve():
            folder = path.with_suffix('')
            folder.mkdir(exist_ok=True)
            for figure in figures:
                if figure.kind != 'table':
                    shutil.copyfile(pictures / f'{figure.name}.png', folder / f'{figure.name}.png')
            pictures = folder
        with atomic_write(path) as part:
            part.write_text('\n'.join(page_lines(numbers, figures, pictures.name)) + '\n')
    except OSError as error:
        raise OutputError(f'a page must be writable, got {str(path)!r} '
                          f'({str(error.strerror).lower()})') from None


def page_lines(numbers: dict, figures: Sequence[Figure], folder: str) -> Iterator[str]:
    """Yield the lines of the page; folder: of the pictures, relative to the page."""
    agree, count = count_verdicts(numbers)
    profile, seeds = numbers['profile'], numbers['seeds']
    command = f'scripts/run reproduce --profile {profile} --seeds {seeds}'
    if numbers['mentor_specs'][1].startswith('file:'):
        command += ' --mentors DIR'
    yield INTRODUCTION.format(profile=profile, seeds=seeds, agree=agree, all=count,
                              command=command)
    yield from table_lines(numbers)
    yield DIFFERENCES
    for title, of_report in (('The figures of the report', True), ('Beyond the report', False)):
        chosen = [each for each in figures
                  if each.is_of_report() == of_report and each.kind != 'table']
        if chosen:
            yield f'\n## {title}\n'
        for figure in chosen:
            yield from _figure_lines(figure, numbers['figures'][figure.name], folder)


def count_verdicts(numbers: dict) -> tuple[int, int]:
    """Return how many figures agree with the report, and how many could."""
    verdicts = [each['agrees'] for each in numbers['figures'].values() if 'agrees' in each]
    return sum(verdicts), len(verdicts)


def _figure_lines(figure: Figure, numbers: dict, folder: str) -> Iterator[str]:
    """Yield the lines of one figure: picture, caption, and whether ours agrees."""
    name = f'Figure {figure.name}' if figure.is_of_report() else figure.title
    yield f'\n### {name}\n\n![{figure.title}]({folder}/{figure.name}.png)\n'
    if not figure.is_of_report():
        yield f'{figure.caption}.'
        for label, ends in numbers.get('ends', {}).items():
            yield (f'With `{label}` the last 50 iterations have a mean return of '
                   f'{ends["together"]:.2f} together and {ends["alone"]:.2f} alone; in '
                   f'{ends["better"]} of {ends["pairs"]} pairs both end better together.')
        yield from _exchange_lines(numbers.get('exchanges', ()))
    elif 'agrees' not in numbers:
        yield f'The report: {figure.caption}. Ours is drawn from the same definition.'
    else:
        ours = 'Ours agrees' if numbers['agrees'] else '**Ours does not**'
        yield f'The report: {figure.caption}. {ours}: {numbers["evidence"]}.'


def _exchange_lines(exchanges: Sequence[dict]) -> Iterator[str]:
    """Yield the lines of a table of what `_exchange_numbers` returns."""
    if exchanges:
        yield ('\nMeans over the last 20 iterations before the exchange, the first 20 after it '
               'and the last 20:\n')
        yield ('| mentors | method | confidence before | after | at the end | return before '
               '| after | at the end |')
        yield '|---|---|---|---|---|---|---|---|'
    for each in exchanges:
        values = (f'{value:.2f}' for name in ('confidence', 'return')
                  for value in each[name].values())
        yield f'| {each["mentors"]} | `{each["method"]}` | {" | ".join(values)} |'
