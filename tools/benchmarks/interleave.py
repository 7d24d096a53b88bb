# SPDX-License-Identifier: Apache-2.0
"""Contestants measured in turn, round after round, and what their figures say together."""

from statistics import median
from typing import NamedTuple

MET, MISSED = 'met', 'missed'


class Row(NamedTuple):
    """
    One line of the result: a figure of every round, and what it should be.

    Attributes
    ----------
    name: what was measured, with its unit where it has one.
    values: one a round, in their order.
    goal: that the median should reach; None for a row without one.
    at_least: whether a larger figure is the better one.

    """

    name: str
    values: list
    goal: float = None
    at_least: bool = True

    def verdict(self):
        """Tell whether the median reaches the goal, and by how much it does not; '' without."""
        if self.goal is None:
            return ''
        middle = median(self.values)
        if middle >= self.goal if self.at_least else middle <= self.goal:
            return MET
        return f'{MISSED} by {abs(middle - self.goal) / self.goal:.0%}'


class Bench:
    """
    What a section is measured with.

    Parameters
    ----------
    rounds: how often each contestant is measured.
    quick: whether only to show that everything works: the figures mean nothing.
    folder: `Path` for what has to be written meanwhile.
    bar: `rich` progress bar.

    Attributes
    ----------
    notes: sentences on what was left out, and why.

    """

    def __init__(self, rounds, quick, folder, bar):
        self.rounds, self.quick, self.folder, self.notes = rounds, quick, folder, []
        self._bar = bar

    def interleave(self, section, contestants, rounds=None):
        """
        Return the figures of each contestant, one a round: `figures[name][round]`.

        contestants: functions by name that measure once. Every other round goes backwards, so
        that a machine that becomes slower is no advantage to whom comes first.
        """
        rounds = rounds or self.rounds
        figures = {name: [] for name in contestants}
        task = self._bar.add_task(section, total=rounds * len(contestants), now='')
        for number in range(rounds):
            for name in list(contestants)[::-1 if number % 2 else 1]:
                self._bar.update(task, now=name)
                figures[name].append(contestants[name]())
                self._bar.advance(task)
        self._bar.update(task, now='')
        return figures


def ratios(ours, theirs):
    """Quotients of figures of the same round: what disturbs a round disturbs both."""
    return [mine / other for mine, other in zip(ours, theirs, strict=True)]
