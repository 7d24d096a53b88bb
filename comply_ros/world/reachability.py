# SPDX-License-Identifier: Apache-2.0
"""The cells from which a goal can be reached, in a time that does not grow with the distance."""

import numpy as np
from numpy.typing import NDArray

Cells = NDArray[np.bool_]  # [y, x]


def can_reach_goal(free: Cells, goal: Cells) -> Cells:
    """
    `found[y, x]`: whether a goal can be reached over free cells; true at goals.

    Free cells next to each other in a row form one segment; segments are joined where they touch.
    """
    is_first = free.copy()
    is_first[:, 1:] &= ~free[:, :-1]
    segment = np.cumsum(is_first).reshape(free.shape) - 1  # segment[y, x], where free
    touch = free[1:] & free[:-1]
    root = connected_components(
        int(segment[-1, -1]) + 1, segment[1:][touch], segment[:-1][touch])
    beside_goal = np.zeros_like(goal)
    beside_goal[:, 1:] |= goal[:, :-1]
    beside_goal[:, :-1] |= goal[:, 1:]
    beside_goal[1:] |= goal[:-1]
    beside_goal[:-1] |= goal[1:]
    has_goal = np.zeros(len(root), dtype=bool)
    has_goal[root[segment[free & beside_goal]]] = True
    found = goal.copy()
    found[free] = has_goal[root[segment[free]]]
    return found


def can_reach(first: NDArray[np.int64], successor: NDArray[np.int32], actions: int,
              wanted: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """
    `found[s]`: whether a state of `wanted[s]` can be reached from state s, in a `Table`.

    States between which a way leads there and back in one step each are joined first, so that
    what is left has few steps.
    """
    count = len(wanted)
    source = np.repeat(np.arange(count), np.diff(first[::actions]))
    ways = np.sort((source * count + successor)[source != successor])
    ways = ways[np.diff(ways, prepend=-1) > 0]
    source, target = ways // count, ways % count
    back = target * count + source
    at = np.searchsorted(ways, back)
    both = ways[np.minimum(at, len(ways) - 1)] == back
    root = connected_components(count, source[both], target[both])
    source, target = root[source[~both]], root[target[~both]]
    found = np.zeros(count, dtype=bool)
    found[root[wanted]] = True
    while True:
        reaches = found[target] & ~found[source]
        if not reaches.any():
            return found[root]
        found[source[reaches]] = True


def connected_components(count: int, one: NDArray[np.int64],
                         other: NDArray[np.int64]) -> NDArray[np.int64]:
    """
    `root[i]` of so many nodes: equal where the pairs `one[k]`, `other[k]` connect them.

    In every round each root joins the lowest one beside it; two rounds halve their number.
    """
    root = np.arange(count)
    while True:
        one, other = root[one], root[other]
        differ = one != other
        if not differ.any():
            return root
        one, other = one[differ], other[differ]
        np.minimum.at(root, np.maximum(one, other), np.minimum(one, other))
        while (root[root] != root).any():
            root = root[root]
