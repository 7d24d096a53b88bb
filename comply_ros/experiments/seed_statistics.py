# SPDX-License-Identifier: Apache-2.0
"""Statistics over seeds: bands of curves, intervals of means."""

from collections.abc import Iterable
from math import nan, pi, sqrt, tan

import numpy as np
from numpy.typing import NDArray

from comply_ros.numerics.summation import sum_in_order

Z = 1.959963984540054  # 97.5 % of a normal distribution lie below


def band(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the 10th and the 90th percentile over the seeds of `values[seed, iteration]`."""
    return np.percentile(values, (10, 90), axis=0)


def interval(values: Iterable[float | None]) -> tuple[float, float, float]:
    """
    Mean of values over seeds and its 95 % interval, by Student's t: `mean, low, high`.

    None (a ratio of no time) is left out. All three are nan without a number, and the same with
    one.
    """
    numbers = np.array([each for each in values if each is not None], dtype=float)
    if not len(numbers):
        return nan, nan, nan
    mean, half = float(numbers.mean()), 0.0
    if len(numbers) > 1:
        half = student_t(len(numbers) - 1) * float(numbers.std(ddof=1)) / len(numbers) ** 0.5
    return mean, mean - half, mean + half


def student_t(freedom: int) -> float:
    """
    Return the t below which 97.5 % of Student's distribution lie.

    freedom: its degrees of freedom. Abramowitz and Stegun, 26.7.5: an expansion in 1 / freedom.
    """
    z, n = Z, freedom
    if n <= 2:  # where the expansion is poor, and the distribution has a closed form
        return tan(0.475 * pi) if n == 1 else 0.95 * sqrt(2.0 / (4.0 * 0.975 * 0.025))
    terms = ((z ** 3 + z) / 4, (5 * z ** 5 + 16 * z ** 3 + 3 * z) / 96,
             (3 * z ** 7 + 19 * z ** 5 + 17 * z ** 3 - 15 * z) / 384,
             (79 * z ** 9 + 776 * z ** 7 + 1482 * z ** 5 - 1920 * z ** 3 - 945 * z) / 92160)
    return z + sum_in_order(term / n ** power for power, term in enumerate(terms, 1))
