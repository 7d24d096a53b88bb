# SPDX-License-Identifier: Apache-2.0
"""When maps over all states are due: by what the last ones cost the loop."""

import time

TIMES = 60  # of what maps cost lie between two at least: the loop, which loses a tenth more than
# is seen here, loses 2 % at most


class CostThrottle:
    """
    Measures what something costs, and puts off the next one for long enough.

    Parameters
    ----------
    least: seconds between two beginnings, however cheap it is.
    clock: returns seconds.

    """

    def __init__(self, least, clock=time.monotonic):
        self._least, self._clock = least, clock
        self._last, self._cost = float('-inf'), 0.0

    def over(self):
        """Tell whether the next one is due."""
        return self._clock() - self._last >= max(self._least, TIMES * self._cost)

    def timed(self, function, *arguments, begins=False):
        """Return what a function returns; its time is one more part of the cost, or the first."""
        begin = self._clock()
        if begins:
            self._last, self._cost = begin, 0.0
        value = function(*arguments)
        self._cost += self._clock() - begin
        return value
