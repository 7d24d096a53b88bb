# SPDX-License-Identifier: Apache-2.0
"""What a command shows at the terminal: a progress bar while it runs, a table at its end."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import isnan
from pathlib import Path
from typing import Any

from rich import progress
from rich.console import Console
from rich.measure import Measurement
from rich.table import Column, Table
from rich.text import Text

console = Console(stderr=True, highlight=False)


class StatusPart(progress.ProgressColumn):
    """Part `number` of the field `now` of a task: a text, or a tuple, the most important first."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self._number = number

    def render(self, task: progress.Task) -> Text:
        """Return the part, or nothing where the task has fewer."""
        now = task.fields['now']
        parts = (now,) if isinstance(now, str) else now
        return Text(''.join(parts[self._number:self._number + 1]), no_wrap=True,
                    overflow='ellipsis')


class FittingProgress(progress.Progress):
    """
    A progress bar that leaves out columns until the line fits the terminal.

    droppable: the columns that may be left out, the least important first.
    """

    def __init__(self, *columns: progress.ProgressColumn,
                 droppable: Sequence[progress.ProgressColumn]) -> None:
        self._all, self._droppable = columns, droppable
        super().__init__(*columns, console=console)

    def make_tasks_table(self, tasks: Iterable[progress.Task]) -> Table:
        """Return the lines of the tasks, for the width that the terminal has now."""
        tasks, unlimited = list(tasks), console.options.update(max_width=10_000)
        for count in range(len(self._droppable) + 1):
            dropped = self._droppable[:count]
            self.columns = tuple(each for each in self._all if each not in dropped)
            table = super().make_tasks_table(tasks)
            if Measurement.get(console, unlimited, table).maximum <= console.width:
                break
        return table


def progress_bar() -> progress.Progress:
    """Return a progress bar, for a `with`; its tasks have a field `now`, see `StatusPart`."""
    spinner, bar = progress.SpinnerColumn(), progress.BarColumn(bar_width=20)
    count = progress.MofNCompleteColumn(table_column=Column(no_wrap=True))
    time = progress.TimeRemainingColumn(compact=True)
    parts = [StatusPart(number) for number in range(3)]
    return FittingProgress(
        spinner, progress.TextColumn('{task.description}'), bar, count, time, *parts,
        droppable=(spinner, parts[2], bar, parts[1], time))


def iteration_status(mean_return: float, confidence: float,
                     steps_per_second: float | None = None) -> tuple[str, ...]:
    """Return the field `now` of a progress bar after an iteration."""
    parts = [f'return {mean_return:7.2f}']
    if not isnan(confidence):  # nan: no decision had advice
        parts.append(f' confidence {confidence:.2f}')
    if steps_per_second:
        parts.append(f' {steps_per_second:,.0f} steps/s')
    return tuple(parts)


def show_table(summary: Mapping[str, Any], seeds: Sequence[int], files: Iterable[Path]) -> None:
    """Print the results of the first of the seeds, and the paths of the files."""
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, value, remark in _rows(summary):
        table.add_row(name, value, f'[dim]{remark}[/]')
    if len(seeds) > 1:
        table.add_row('seed', str(seeds[0]), f'[dim]the first of {len(seeds)}; the picture and '
                      'summary.json have all[/]')
    console.print()
    console.print(table)
    console.print()
    for path in files:
        console.print(f'  {path}', soft_wrap=True)


def show_columns(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Print rows of text under their heads: names to the left, numbers to the right."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    for number, head in enumerate(heads):
        table.add_column(head, justify='right' if number else 'left')
    for row in rows:
        table.add_row(*row)
    console.print(table)


def _rows(summary: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    returns, convergence = summary['return_per_iteration'], summary['time_to_convergence']
    yield 'optimal policy', f'{summary["optimal_return"]:.2f}', 'expected return of an episode'
    if summary['mentor_return'] is not None:
        optimality = summary['mentor_optimality']
        yield ('mentor', f'{summary["mentor_return"]:.2f}', summary['mentor'] + (
            '' if optimality is None else f', {optimality:.1%} optimal'))
    yield 'random policy', f'{summary["random_return"]:.2f}', ''
    yield 'learner, first', f'{returns[0]:.2f}', f'{summary["method"]}, mean of an iteration'
    yield ('learned policy', f'{summary["policy_return"]:.2f}',
           'expected return without exploration')
    yield 'learner, last', f'{returns[-1]:.2f}', f'iteration {len(returns)}'
    counted = len(returns) - summary['measuring_iterations']
    rule = 'at or below' if summary['profile'] == 'published' else 'until the return stays above'
    yield ('time to convergence', 'never' if convergence is None else f'{convergence}',
           f'of {counted} iterations {rule} {summary["convergence_threshold"]:.2f}')
    yield ('steps', f'{summary["steps"]:,}',
           f'{summary["steps_per_second"]:,.0f} a second, {summary["wall_seconds"]:.1f} s')
    others = summary['other_mentors']
    yield 'digest', summary['digest'][:16], 'the same options give the same bits' if not others \
        else f'{1 + others} mentors spoke: the same options need not give the same bits'
