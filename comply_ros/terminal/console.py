# SPDX-License-Identifier: Apache-2.0
"""What a command shows at the terminal: a progress bar while it runs, a table at its end."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from math import isnan
import os
from pathlib import Path
from typing import Any

from rich import progress
from rich.cells import cell_len
from rich.console import Console, ConsoleDimensions
from rich.measure import Measurement
from rich.table import Column, Table
from rich.text import Text

from comply_ros.storage.file_system import printable
from comply_ros.terminal.interrupts import stops

NO_TERMINAL_SIZE = 200, 25  # columns and rows for a file or a pipe: no line needs a break


class PlainConsole(Console):
    """
    A console for text as it is: names that a user chose are no markup, and no emoji.

    Results go to standard output, where a closed pipe raises BrokenPipeError. Progress goes to
    standard error, where it is left out after that.
    """

    def __init__(self, stderr: bool = False) -> None:
        super().__init__(stderr=stderr, highlight=False, markup=False, emoji=False)

    @property
    def size(self) -> ConsoleDimensions:
        """Columns and rows of the terminal that the text goes to."""
        if self.is_terminal or 'COLUMNS' in os.environ:
            return super().size
        return ConsoleDimensions(*NO_TERMINAL_SIZE)

    def on_broken_pipe(self) -> None:
        """Do what the class says about a closed pipe."""
        if not self.stderr:
            raise BrokenPipeError
        self.quiet = True


console = PlainConsole()
progress_console = PlainConsole(stderr=True)


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
    A progress bar in the first of its layouts that fits the terminal.

    layouts: the columns of each, the widest first. Ctrl-Z gives the cursor back to the shell.
    """

    def __init__(self, *layouts: Sequence[progress.ProgressColumn]) -> None:
        self._layouts, self._stops = layouts, ExitStack()
        super().__init__(*layouts[0], console=progress_console, redirect_stdout=False)

    def start(self) -> None:
        """Show the bar."""
        super().start()
        if self.console.is_terminal:
            self._stops.enter_context(
                stops(lambda: self.console.show_cursor(True), self._take_up))

    def stop(self) -> None:
        """Show the bar for the last time."""
        self._stops.close()
        super().stop()

    def _take_up(self) -> None:
        self.console.show_cursor(False)
        self.refresh()

    def make_tasks_table(self, tasks: Iterable[progress.Task]) -> Table:
        """Return the lines of the tasks, for the width that the terminal has now."""
        tasks, unlimited = list(tasks), progress_console.options.update(max_width=10_000)
        for self.columns in self._layouts:
            table = super().make_tasks_table(tasks)
            width = Measurement.get(progress_console, unlimited, table).maximum
            if width <= progress_console.width:
                break
        return table


def progress_bar() -> progress.Progress:
    """Return a progress bar, for a `with`; its tasks have a field `now`, see `StatusPart`."""
    name = progress.TextColumn('{task.description}', markup=False)
    wide, narrow = (progress.BarColumn(bar_width=width) for width in (20, 6))
    count = progress.MofNCompleteColumn(table_column=Column(no_wrap=True))
    time = progress.TimeRemainingColumn(compact=True)
    first, second, third = (StatusPart(number) for number in range(3))
    return FittingProgress(
        (progress.SpinnerColumn(), name, wide, count, time, first, second, third),
        (name, wide, count, time, first, second, third),
        (name, wide, count, time, first, second),
        (name, narrow, count, time, first, second),
        (name, narrow, count, first, second),
        (name, narrow, count, first),
        (name, count, first))


def iteration_status(mean_return: float, confidence: float,
                     steps_per_second: float | None = None) -> tuple[str, ...]:
    """Return the field `now` of a progress bar after an iteration."""
    parts = [f'return {mean_return:7.2f}']
    if not isnan(confidence):  # nan: no decision had advice
        parts.append(f' confidence {confidence:.2f}')
    if steps_per_second:
        parts.append(f' {steps_per_second:,.0f} steps/s')
    return tuple(parts)


def show_table(summary: Mapping[str, Any], seeds: Sequence[int]) -> None:
    """Print the results of the first of the seeds."""
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    rows = list(_rows(summary))
    if len(seeds) > 1:
        rows.append(('seed', str(seeds[0]),
                     f'the first of {len(seeds)}; the picture and summary.json have all'))
    for name, value, remark in rows:
        table.add_row(name, value, Text(printable(remark), style='dim', overflow='fold'))
    console.print()
    console.print(table)
    console.print()


def show_paths(files: Iterable[Path]) -> None:
    """
    Print the paths of files as soon as each of them is there.

    On a terminal that is too narrow, the name of a file is in a line of its own.
    """
    for path in files:
        text = f'  {printable(path)}'
        if console.is_terminal and cell_len(text) > console.width:
            text = f'  {printable(path.parent)}/\n    {printable(path.name)}'
        console.print(text, soft_wrap=True)


def show_columns(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Print rows of text under their heads: names to the left, numbers to the right."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    for number, head in enumerate(heads):
        table.add_column(head, justify='right' if number else 'left', overflow='fold')
    for row in rows:
        table.add_row(*row)
    console.print(table)


def _rows(summary: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    returns, is_known = summary['return_per_iteration'], not summary['unknown']
    if is_known:
        yield from _reference_rows(summary)
    yield 'learner, first', f'{returns[0]:.2f}', f'{summary["method"]}, mean of an iteration'
    if is_known and summary['policy_return'] is None:
        yield 'learned policy', '-', f'{summary["method"]} has no service save'
    elif is_known:
        yield ('learned policy', f'{summary["policy_return"]:.2f}',
               'expected return if it stopped exploring')
    yield 'learner, last', f'{returns[-1]:.2f}', f'iteration {len(returns)}'
    if is_known:
        yield 'time to convergence', *_convergence(summary, len(returns))
    else:
        yield ('not known', '', 'returns of the optimal, the random and the learned policy and of '
               'the mentor, time to convergence: the world has no model')
    yield ('steps', f'{summary["steps"]:,}',
           f'{summary["steps_per_second"]:,.0f} a second, {summary["wall_seconds"]:.1f} s')
    others = summary['other_mentors']
    if summary['digest'] is None:
        return
    yield 'digest', summary['digest'][:16], 'the same options give the same bits' if not others \
        else f'{1 + others} mentors published: the same options need not give the same bits'


def _reference_rows(summary: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Yield what the learner is compared with."""
    yield 'optimal policy', f'{summary["optimal_return"]:.2f}', 'expected return of an episode'
    if summary['mentor_return'] is not None:
        optimality = summary['mentor_optimality']
        share = '' if optimality is None else f', {optimality:.1%} optimal'
        several = summary['mentor_returns']
        best = max(several, key=several.__getitem__) if several else summary['mentor']
        yield ('best mentor' if several else 'mentor', f'{summary["mentor_return"]:.2f}',
               best + share)
        for name, value in several.items():
            if name != best:
                yield f'mentor {name}', f'{value:.2f}', ''
        if several:
            yield ('best of mentors', f'{summary["best_of_mentors_return"]:.2f}',
                   'of whoever follows the best one of them in each state')
    yield 'random policy', f'{summary["random_return"]:.2f}', ''


def _convergence(summary: Mapping[str, Any], iterations: int) -> tuple[str, str]:
    """Return the time to convergence, and what it is."""
    convergence, counted = summary['time_to_convergence'], iterations - summary[
        'measuring_iterations']
    rule = 'at or below' if summary['profile'] == 'published' else 'until the return stays above'
    return ('never' if convergence is None else f'{convergence}',
            f'of {counted} iterations {rule} {summary["convergence_threshold"]:.2f}')
