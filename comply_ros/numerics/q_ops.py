# SPDX-License-Identifier: Apache-2.0
"""What can be asked of the action values of one state."""

from comply_ros.numerics.jit import kernel

NOTHING = -1e308  # below every action value of an action that the cell has


@kernel
def max_q_except(s, excluded, q):
    """Highest action value in state s without the excluded action, or NOTHING: (2.17), (3.12)."""
    best = NOTHING
    for a in range(4):
        value = q[s, a] if a != excluded else NOTHING
        best = value if value > best else best
    return best


@kernel
def count_untried(s, q, visits):
    """How many actions of state s were never tried."""
    count = 0
    for a in range(4):
        count += int(q[s, a] > NOTHING and visits[s, a] == 1.0)
    return count
