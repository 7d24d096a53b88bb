# SPDX-License-Identifier: Apache-2.0
"""What a learning curve is measured against: computed aside, so that nobody waits for it."""

import time

from comply_ros.nodes.mentor import in_background
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.planning import ReferenceReturns

REST = 0.5  # seconds from one value of a mentor to the beginning of the next


class ReferenceReturnsCache:
    """
    The optimal return of a world, and what the mentor's policy is worth, as soon as known.

    One computation at a time: of a policy that is painted quickly, only some strokes are valued.
    """

    def __init__(self):
        self._world, self._advice, self._yardstick = None, None, None
        self._running, self._optimal, self._mentor, self._next = None, None, None, 0.0

    def of(self, world, advice):
        """Return (optimal, mentor): expected returns from the starts, None where not known."""
        self._take()
        if world is not self._world:
            self._world, self._advice, self._yardstick = world, None, None
            self._optimal, self._mentor, self._next = None, None, 0.0
        if self._running is None and world is not None and time.monotonic() >= self._next:
            self._begin(world, advice)
        return self._optimal, self._mentor

    def _begin(self, world, advice):
        """Begin to compute what is missing, if anything is."""
        if self._yardstick is None:
            self._running = world, None, in_background(ReferenceReturns, world)
        elif advice is not self._advice and _says_something(advice):
            self._running = world, advice, in_background(self._yardstick.return_of, advice)
        elif advice is not self._advice:
            self._advice, self._mentor = advice, None

    def _take(self):
        """Take what was computed meanwhile, if it is of the world that is still here."""
        if self._running is None or not self._running[2].done():
            return
        world, advice, future = self._running
        self._running, self._next = None, time.monotonic() + REST
        if world is not self._world:
            return
        if advice is None:
            self._take_yardstick(future)
        else:
            self._advice, self._mentor = advice, future.result()

    def _take_yardstick(self, future):
        if future.exception():  # a world whose values do not settle has no level to show
            self._next = float('inf')
            return
        self._yardstick = future.result()
        self._optimal, self._next = self._yardstick.optimal_return, 0.0


def _says_something(advice):
    return advice is not None and bool((advice != NO_ACTION).any())
