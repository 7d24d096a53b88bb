# SPDX-License-Identifier: Apache-2.0
"""Sums of floats that have the same bits on every version of Python."""

from collections.abc import Iterable


def sum_in_order(values: Iterable[float]) -> float:
    """
    Sum of the values, added one after the other.

    The built-in `sum` compensates rounding errors since Python 3.12, so its bits depend on the
    version.
    """
    total = 0.0
    for value in values:
        total += value
    return total


def mean_in_order(values: list[float]) -> float:
    """Mean of the values, which must not be empty."""
    return sum_in_order(values) / len(values)
