# SPDX-License-Identifier: Apache-2.0
"""The time of each step of a loop over topics, recorded where the world receives the action."""

from pathlib import Path
from statistics import median
import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

WARM_UP = 300  # steps that are not counted: until then all nodes have found each other
WARM_FILE, TIMES_FILE = 'warm', 'step_times.bin'


class StepTimes:
    """
    Records times in memory and writes them at the end, so that the loop never waits for a disk.

    Parameters
    ----------
    folder: for the file of times, and for an empty file that appears when the loop is warm.

    """

    def __init__(self, folder: Path, warm_up: int = WARM_UP) -> None:
        self._folder, self._warm_up = folder, warm_up
        self._times: list[int] = []

    def record(self, is_start: bool = False) -> None:
        """Record a step, or the start of an episode."""
        times = self._times
        times.append(-time.monotonic_ns() if is_start else time.monotonic_ns())
        if len(times) == self._warm_up:
            (self._folder / WARM_FILE).touch()

    def write(self) -> None:
        """Write all times after the warm-up, in nanoseconds; those of a start are negative."""
        np.array(self._times[self._warm_up:], dtype=np.int64).tofile(self._folder / TIMES_FILE)


class LoopSpeed(NamedTuple):
    """
    The speed of a loop.

    Attributes
    ----------
    rate: steps per second.
    episodes: started.
    median, percentile_99: of the time from one step to the next, in microseconds.

    """

    rate: float
    episodes: int
    median: float
    percentile_99: float


def loop_speed(times: NDArray[np.int64]) -> LoopSpeed:
    """
    `LoopSpeed` of what `StepTimes.write` wrote.

    Raises
    ------
    ValueError: for fewer than two steps.

    """
    steps = np.abs(times)[times > 0]
    if len(steps) < 2:
        raise ValueError(f'the speed of a loop needs at least 2 steps, got {len(steps)}')
    seconds = (abs(int(times[-1])) - abs(int(times[0]))) / 1e9
    intervals = np.diff(np.abs(times)) / 1e3
    return LoopSpeed((len(steps) - int(times[0] > 0)) / seconds, int((times < 0).sum()),
                     float(median(intervals)), float(np.percentile(intervals, 99)))
