# SPDX-License-Identifier: Apache-2.0
"""The number of actions as kernels know it, and operations on the values of one state."""

from typing import Any

from numpy.typing import NDArray

from comply_ros.numerics.jit import kernel

NOTHING = -1e308  # below the value of every action that the state has
MOST_UNROLLED = 16  # actions for which loops over them are compiled for their number

Actions = tuple[int, ...]  # see `actions_for_kernels`


def actions_for_kernels(n_actions: int) -> Actions:
    """
    Return a number of actions as kernels take it, a tuple whose length the compiler knows.

    Up to 16 actions, it has the number as often as there are actions: each number has machine
    code of its own, without loops. Above that it has the number once, and all numbers share one.
    """
    return (n_actions,) * (n_actions if n_actions <= MOST_UNROLLED else 1)


@kernel
def count_actions(actions: Actions) -> int:
    """Return the number of actions from a tuple of `actions_for_kernels`."""
    return len(actions) if len(actions) > 1 else actions[0]


@kernel
def max_q_except(s: int, excluded: int, q: NDArray[Any], actions: Actions) -> float:
    """Highest action value in state s without the excluded action, or NOTHING: (2.17), (3.12)."""
    best = NOTHING
    if len(actions) != 4:
        for a in range(count_actions(actions)):
            if a != excluded and q[s, a] > best:
                best = q[s, a]
        return best
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
def count_untried(s: int, q: NDArray[Any], visits: NDArray[Any], actions: Actions) -> int:
    """Return the number of actions of state s that were never tried."""
    count = 0
    for a in range(count_actions(actions)):
        count += int(q[s, a] > NOTHING and visits[s, a] == 1.0)
    return count


@kernel
def greedy_or_untried_action(s: int, explores: bool, u: float, q: NDArray[Any],
                             visits: NDArray[Any], actions: Actions) -> int:
    """
    Return an action of state s that was never tried if one is to be explored, else a best action.

    u: uniform in [0, 1); candidates are equally likely.
    """
    best, untried, ties = max_q_except(s, -1, q, actions), count_untried(s, q, visits, actions), 0
    for a in range(count_actions(actions)):
        ties += int(q[s, a] == best)
    explores = explores and untried > 0
    pick = int(u * (untried if explores else ties))
    for a in range(count_actions(actions)):
        if (q[s, a] > NOTHING and visits[s, a] == 1.0) if explores else q[s, a] == best:
            if pick == 0:
                return a
            pick -= 1
    return -1
