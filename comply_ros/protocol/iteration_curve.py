# SPDX-License-Identifier: Apache-2.0
"""A number for each iteration of a run, as many as a chart needs."""

from __future__ import annotations

from bisect import bisect_left
from typing import NamedTuple

MAX_POINTS = 2000  # of a curve; a longer one loses every second point


class IterationCurve(NamedTuple):
    """Iterations, ascending, and a number for each: the mean return, or the confidence."""

    iterations: tuple[int, ...] = ()
    values: tuple[float, ...] = ()

    def extended(self, iteration: int, value: float) -> IterationCurve:
        """
        Return the curve that ends with an iteration.

        Points from that iteration on are removed: a learner that was reset reports them again.
        A curve that is too long loses every second point, but never the newest one.
        """
        before = self.before(iteration)
        iterations, values = (*before.iterations, iteration), (*before.values, value)
        if len(iterations) <= MAX_POINTS:
            return IterationCurve(iterations, values)
        first = 1 - len(iterations) % 2
        return IterationCurve(iterations[first::2], values[first::2])

    def before(self, iteration: int) -> IterationCurve:
        """Return the part of the curve before an iteration."""
        count = bisect_left(self.iterations, iteration)
        return IterationCurve(self.iterations[:count], self.values[:count])

    def followed_by(self, later: IterationCurve) -> IterationCurve:
        """Return this curve up to the first iteration of another one, then that one."""
        if not later.iterations:
            return self
        before = self.before(later.iterations[0])
        return IterationCurve(before.iterations + later.iterations, before.values + later.values)

    @property
    def has_lone_points(self) -> bool:
        """Whether a number has none beside it, so that no line shows it."""
        known = [False, *(value == value for value in self.values), False]
        return any(here and not (before or after)
                   for before, here, after in zip(known, known[1:], known[2:]))

    @property
    def is_known(self) -> bool:
        """Whether any of the numbers is one: nan stands for an iteration without."""
        return any(value == value for value in self.values)
