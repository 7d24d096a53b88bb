# SPDX-License-Identifier: Apache-2.0
"""The smooth line of a learning curve, for pictures and for the page, which has no matplotlib."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

LONGEST_WINDOW = 9  # iterations


def window_of(count: int) -> int:
    """Return over how many values a running mean of `count` values is taken; 1: each alone."""
    return min(LONGEST_WINDOW, count // 8) // 2 * 2 + 1


def running_mean(values: ArrayLike) -> NDArray[np.float64]:
    """Mean of the values in a window around each; the window is shorter at both ends."""
    values = np.asarray(values, dtype=float)
    reach = window_of(len(values)) // 2
    return np.array([values[max(0, i - reach):i + reach + 1].mean() for i in range(len(values))])
