# SPDX-License-Identifier: Apache-2.0
"""When each step over topics was taken, noted where the world hears the action."""

from statistics import median
import time
from typing import NamedTuple

import numpy as np

WARM = 300  # steps before the measuring begins: everybody has found everybody
BEGUN, STAMPS = 'begun', 'stamps.bin'


class Stamps:
    """
    Notes moments in memory and writes them at the end, so that the loop does not wait for a disk.

    Parameters
    ----------
    folder: `Path` for the file; another one, `begun`, is made there when the loop is warm.

    """

    def __init__(self, folder, warm=WARM):
        self._folder, self._warm, self._moments = folder, warm, []

    def note(self, begins=False):
        """Note a step that is taken now, or an episode that begins."""
        moments = self._moments
        moments.append(-time.monotonic_ns() if begins else time.monotonic_ns())
        if len(moments) == self._warm:
            (self._folder / BEGUN).touch()

    def write(self):
        """Write all moments since the loop was warm, in nanoseconds; of a beginning negative."""
        np.array(self._moments[self._warm:], dtype=np.int64).tofile(self._folder / STAMPS)


class Pace(NamedTuple):
    """
    How fast a loop goes.

    Attributes
    ----------
    rate: steps per second. episodes: that began. median, late: of the time from one step to the
    next, and what 99 % of them stay below, in microseconds.

    """

    rate: float
    episodes: int
    median: float
    late: float


def pace(moments):
    """
    `Pace` of `Stamps.write`.

    Raises
    ------
    ValueError: if there are fewer than two steps.

    """
    steps = np.abs(moments)[moments > 0]
    if len(steps) < 2:
        raise ValueError(f'a pace needs at least 2 steps, got {len(steps)}')
    seconds = (abs(int(moments[-1])) - abs(int(moments[0]))) / 1e9
    times = np.diff(np.abs(moments)) / 1e3
    return Pace((len(steps) - int(moments[0] > 0)) / seconds, int((moments < 0).sum()),
                float(median(times)), float(np.percentile(times, 99)))
