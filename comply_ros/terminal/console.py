# SPDX-License-Identifier: Apache-2.0
"""What a session shows at the terminal: a progress bar while it runs, a table at its end."""

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table

console = Console(stderr=True, highlight=False)


def progress_bar():
    """Return a `rich` progress bar, to be used in a `with`."""
    return Progress(
        SpinnerColumn(), TextColumn('{task.description}'), BarColumn(bar_width=20),
        MofNCompleteColumn(), TextColumn('{task.fields[now]}', markup=False),
        TimeRemainingColumn(), console=console)


def words(mean_return, confidence, steps_per_second=None):
    """How an iteration went, in one phrase for the progress bar."""
    msg = [f'return {mean_return:7.2f}']
    if confidence == confidence:  # nan: nobody to trust
        msg.append(f'confidence {confidence:.2f}')
    if steps_per_second:
        msg.append(f'{steps_per_second:,.0f} steps/s')
    return '  '.join(msg)


def show_table(summary, seeds, pictures):
    """Print what was reached, and where the files are; summary: of the first of the seeds."""
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, value, remark in _rows(summary):
        table.add_row(name, value, f'[dim]{remark}[/]')
    if len(seeds) > 1:
        table.add_row('seed', str(seeds[0]), f'[dim]the first of {len(seeds)}; the picture and '
                      'summary.json have all[/]')
    console.print()
    console.print(table)
    console.print()
    for path in pictures:
        console.print(f'  {path}', soft_wrap=True)


def show_columns(heads, rows):
    """Print rows of text under their heads: names to the left, numbers to the right."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    for number, head in enumerate(heads):
        table.add_column(head, justify='right' if number else 'left')
    for row in rows:
        table.add_row(*row)
    console.print(table)


def _percent(optimality):
    return '' if optimality is None else f', {optimality:.1%} optimal'


def _rows(summary):
    returns, convergence = summary['return_per_iteration'], summary['time_to_convergence']
    yield 'optimal policy', f'{summary["optimal_return"]:.2f}', 'expected return of an episode'
    if summary['mentor_return'] is not None:
        yield ('mentor', f'{summary["mentor_return"]:.2f}',
               summary['mentor'] + _percent(summary['mentor_optimality']))
    yield 'random policy', f'{summary["random_return"]:.2f}', ''
    yield 'learner, first', f'{returns[0]:.2f}', f'{summary["method"]}, mean of an iteration'
    yield 'learner, last', f'{returns[-1]:.2f}', f'iteration {len(returns)}'
    counted = len(returns) - summary['measuring_iterations']
    rule = 'at or below' if summary['profile'] == 'published' else 'until the return stays above'
    yield ('time to convergence', 'never' if convergence is None else f'{convergence}',
           f'of {counted} iterations {rule} {summary["convergence_threshold"]:.2f}')
    yield ('steps', f'{summary["steps"]:,}',
           f'{summary["steps_per_second"]:,.0f} a second, {summary["wall_seconds"]:.1f} s')
    yield 'digest', summary['digest'][:16], 'the same options give the same bits'
