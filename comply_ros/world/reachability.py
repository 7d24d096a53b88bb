# SPDX-License-Identifier: Apache-2.0
"""From which cells a way leads to a goal, in a time that does not grow with the ways' length."""

import numpy as np


def reachable(free, goal):
    """
    `reachable[y, x]`, bool: from where a goal can be reached over free cells; true at goals.

    Free cells beside each other in a row are one run; runs are joined where they touch.

    Parameters
    ----------
    free, goal: `[y, x]`, bool.

    """
    run = np.cumsum(_begins(free)).reshape(free.shape) - 1  # run[y, x], where free
    touch = free[1:] & free[:-1]
    root = connected_components(int(run[-1, -1]) + 1, run[1:][touch], run[:-1][touch])
    beside = root[run[free & _neighbours(goal)]]
    arrives = np.zeros(len(root), dtype=bool)
    arrives[beside] = True
    found = goal.copy()
    found[free] = arrives[root[run[free]]]
    return found


def connected_components(count, one, other):
    """
    `root[i]` of so many things: equal where pairs `one[k]`, `other[k]` connect them.

    In every round each root joins the lowest one beside it; two rounds halve their number.
    """
    root = np.arange(count)
    while True:
        one, other = root[one], root[other]
        apart = one != other
        if not apart.any():
            return root
        one, other = one[apart], other[apart]
        np.minimum.at(root, np.maximum(one, other), np.minimum(one, other))
        while (root[root] != root).any():
            root = root[root]


def _begins(free):
    """Tell where a free cell has none to its left."""
    begins = free.copy()
    begins[:, 1:] &= ~free[:, :-1]
    return begins


def _neighbours(goal):
    """Tell where a goal is to the left or right, below or above."""
    beside = np.zeros_like(goal)
    beside[:, 1:] |= goal[:, :-1]
    beside[:, :-1] |= goal[:, 1:]
    beside[1:] |= goal[:-1]
    beside[:-1] |= goal[1:]
    return beside
