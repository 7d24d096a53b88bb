# SPDX-License-Identifier: Apache-2.0
"""Candidates are measured in turn, round after round, and compared within a round."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple, TypeVar

Name = TypeVar('Name', bound=Hashable)
Result = TypeVar('Result')


class BenchmarkError(RuntimeError):
    """A benchmark that cannot run; the message says why."""


class Row(NamedTuple):
    """
    One line of the result.

    Attributes
    ----------
    name: what was measured, with its unit if it has one.
    values: one for each round, in order.
    goal: for the median; None for a row without a goal.
    at_least: whether a larger value is better.

    """

    name: str
    values: list[float]
    goal: float | None = None
    at_least: bool = True

    def verdict(self) -> str:
        """Tell whether the median reaches the goal, or by how much it misses it; '' without."""
        if self.goal is None:
            return ''
        middle = median(self.values)
        if middle >= self.goal if self.at_least else middle <= self.goal:
            return 'met'
        return f'missed by {abs(middle - self.goal) / self.goal:.0%}'


class Bench:
    """
    The settings of a benchmark, and the loop that measures candidates in turn.

    Parameters
    ----------
    rounds: how often each candidate is measured.
    quick: whether to show only that everything works: the numbers mean nothing.
    folder: for temporary files.
    bar: `rich` progress bar.

    Attributes
    ----------
    notes: sentences about what was left out, and why.

    """

    def __init__(self, rounds: int, quick: bool, folder: Path, bar: Any) -> None:
        self.rounds, self.quick, self.folder = rounds, quick, folder
        self.notes: list[str] = []
        self._bar = bar

    def interleave(self, section: str, candidates: Mapping[Name, Callable[[], Result]],
                   rounds: int | None = None) -> dict[Name, list[Result]]:
        """
        Return `results[name][round]` of all candidates.

        candidates: functions that measure once. Every other round goes backwards, so that the
            first candidate has no advantage on a machine that becomes slower.
        """
        rounds = rounds or self.rounds
        results: dict[Name, list[Result]] = {name: [] for name in candidates}
        task = self._bar.add_task(section, total=rounds * len(candidates), now='')
        for number in range(rounds):
            for name in list(candidates)[::-1 if number % 2 else 1]:
                self._bar.update(task, now=str(name))
                results[name].append(candidates[name]())
                self._bar.advance(task)
        self._bar.update(task, now='')
        return results


def ratios(numerators: Sequence[float], denominators: Sequence[float]) -> list[float]:
    """Quotients of the same round: what disturbs a round disturbs both numbers."""
    return [top / bottom for top, bottom in zip(numerators, denominators, strict=True)]
