# SPDX-License-Identifier: Apache-2.0
"""What many seeds say together: bands of curves, intervals of means."""

import numpy as np

LEVEL_NAMES = {1.0: '100 %', 0.999: '99.9 %', 0.74: '~74 %', 0.5: '50 %'}
RESAMPLES = 2000


def band(values):
    """Return the 10th and the 90th percentile over the seeds of `values[seed, iteration]`."""
    return np.percentile(values, (10, 90), axis=0)


def interval(values):
    """
    Mean of values over seeds and its 95 % interval, by bootstrap with a seed of its own.

    values: numbers; None (a ratio of no time) is left out. Returns `mean, low, high`, nan without
    any number.
    """
    numbers = np.array([each for each in values if each is not None], dtype=float)
    if not len(numbers):
        return (float('nan'),) * 3
    picks = np.random.default_rng(0).integers(len(numbers), size=(RESAMPLES, len(numbers)))
    low, high = np.percentile(numbers[picks].mean(axis=1), (2.5, 97.5))
    return float(numbers.mean()), float(low), float(high)
