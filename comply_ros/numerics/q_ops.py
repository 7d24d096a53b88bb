# SPDX-License-Identifier: Apache-2.0
"""Maximum and number of untried actions over the action values of one state."""

from typing import Any

from numpy.typing import NDArray

from comply_ros.numerics.jit import kernel

NOTHING = -1e308  # below the value of every action that the state has


@kernel
def max_q_except(s: int, excluded: int, q: NDArray[Any]) -> float:
    """Highest action value in state s without the excluded action, or NOTHING: (2.17), (3.12)."""
    best = NOTHING
    if excluded != 0 and q[s, 0] > best:
        best = q[s, 0]
    if excluded != 1 and q[s, 1] > best:
        best = q[s, 1]
    if excluded != 2 and q[s, 2] > best:
        best = q[s, 2]
    if excluded != 3 and q[s, 3] > best:
        best = q[s, 3]
    return best


@kernel
def count_untried(s: int, q: NDArray[Any], visits: NDArray[Any]) -> int:
    """Return the number of actions of state s that were never tried."""
    count = 0
    for a in range(4):
        count += int(q[s, a] > NOTHING and visits[s, a] == 1.0)
    return count
