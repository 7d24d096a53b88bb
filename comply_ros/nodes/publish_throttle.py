# SPDX-License-Identifier: Apache-2.0
"""Limits how often a node publishes arrays over all states, by the time that they take."""

from collections.abc import Callable
import time
from typing import Any, TypeVar

T = TypeVar('T')
TIMES = 60  # the maps' cost that lies between two of them, at least: 2 % of the loop at most,
# which loses a tenth more than is measured here


class CostThrottle:
    """Measures what something costs, and puts off the next one, for `period` seconds at least."""

    def __init__(self, period: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._period, self._clock = period, clock
        self._start, self._cost = float('-inf'), 0.0

    def is_due(self) -> bool:
        """Tell whether it is time for the next one."""
        return self._clock() - self._start >= max(self._period, TIMES * self._cost)

    def start(self, function: Callable[..., T], *arguments: Any) -> T:
        """Return what a function returns; its time is the first part of the cost."""
        self._start, self._cost = self._clock(), 0.0
        return self.go_on(function, *arguments)

    def go_on(self, function: Callable[..., T], *arguments: Any) -> T:
        """Return what a function returns; its time is one more part of the cost."""
        begin = self._clock()
        value = function(*arguments)
        self._cost += self._clock() - begin
        return value
