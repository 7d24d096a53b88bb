# SPDX-License-Identifier: Apache-2.0
"""Value iteration in machine code: the bits of `value_iteration`, in a fraction of the time."""

import numpy as np
from numpy.typing import NDArray

from comply_ros.numerics.action_values import NOTHING
from comply_ros.numerics.jit import compiled, kernel, run_compiled
from comply_ros.world.mdp import World

Floats = NDArray[np.float64]
Integers = NDArray[np.int32]
Bools = NDArray[np.bool_]


def has_compiler() -> bool:
    """Whether there is a compiler; without one, `value_iteration` is faster than this."""
    return compiled(sweep_until_settled) is not sweep_until_settled


def compiled_value_iteration(world: World, discount: float, tolerance: float,
                             most: int) -> tuple[Floats, float]:
    """
    `v[s]` after value iteration, and the largest change of a value in its last sweep.

    tolerance: the first sweep in which no value changes by so much is the last. most: sweeps.
    """
    width, states = world.grid.width, len(world.free)
    values, other = np.zeros(states), np.zeros(states)
    changed = np.tile(np.array([width, 0], dtype=np.int32), (world.grid.height + 2, 1))
    changed[1:-1] = 0, width
    number = run_compiled(
        sweep_until_settled, values, other, changed, changed.copy(), most, tolerance, discount,
        float(world.grid.intended), width, world.successor, world.reward, world.slips,
        world.free, plain_runs(world))
    newest = other if number % 2 else values
    return newest, float(np.abs(other - values).max())


def plain_runs(world: World) -> Integers:
    """
    `ends[s]`: the first state from s on that is not plain.

    A state is plain where every action leads to another cell, can be a slip, and earns the same
    `step_reward`: most states of a large map, and they stand next to each other in rows.
    """
    states = np.arange(len(world.free), dtype=np.int32)
    plain = (world.free & world.slips.all(axis=1)
             & (world.successor != states[:, None]).all(axis=1)
             & (world.reward == world.grid.step_reward).all(axis=1))
    return np.minimum.accumulate(np.where(plain, len(states), states)[::-1])[::-1].astype(np.int32)


@kernel
def sweep_until_settled(values: Floats, other: Floats, changed: Integers, change: Integers,
                        most: int, tolerance: float, discount: float, intended: float,
                        width: int, successor: Integers, reward: Floats, slips: Bools,
                        free: Bools, ends: Integers) -> int:
    """
    Change values by sweeps of value iteration (2.14) until none changes by the tolerance.

    Return how many sweeps it took, at most `most`; after an odd number `other[s]` has the newest.
    A value is computed only where a neighbour's value has changed in the sweep before.

    Parameters
    ----------
    values, other: `v[s]`, both 0.
    changed, change: room for the first and last column + 1 of the changes of each row, in the
        last sweep and in this one; a row of (width, 0) before the first row and after the last.
    ends: see `plain_runs`.

    """
    height = len(changed) - 2
    for number in range(most):
        settled = True
        for y in range(height):
            first = min(changed[y, 0], changed[y + 1, 0] - 1, changed[y + 2, 0])
            last = max(changed[y, 1], changed[y + 1, 1] + 1, changed[y + 2, 1])
            begin, end = y * width + max(first, 0), y * width + min(last, width)
            update(begin, end, values, other, discount, intended, width, successor, reward,
                   slips, free, ends)
            while begin < end and other[begin] == values[begin]:
                begin += 1
            while begin < end and other[end - 1] == values[end - 1]:
                end -= 1
            change[y + 1, 0] = begin - y * width if begin < end else width
            change[y + 1, 1] = end - y * width if begin < end else 0
            s = begin
            while settled and s < end:
                settled = abs(other[s] - values[s]) < tolerance
                s += 1
        if settled:
            return number + 1
        values, other = other, values
        changed, change = change, changed
    return most


@kernel
def update(begin: int, end: int, values: Floats, other: Floats, discount: float, intended: float,
           width: int, successor: Integers, reward: Floats, slips: Bools, free: Bools,
           ends: Integers) -> None:
    """Change other[s] from begin to end into the best values one step ahead of `values[s]`."""
    s = begin
    while s < end:
        if ends[s] > s:
            stop = min(ends[s], end)
            update_plain(s, stop, values, other, discount, intended, width, reward[s, 0])
            s = stop
        else:
            other[s] = best_value(s, values, discount, intended, successor, reward, slips) \
                if free[s] else 0.0
            s += 1


@kernel
def update_plain(begin: int, end: int, values: Floats, other: Floats, discount: float,
                 intended: float, width: int, earned: float) -> None:
    """Change other[s] from begin to end, all plain: a loop without a branch."""
    for s in range(begin, end):
        left = earned + discount * values[s - 1]
        right = earned + discount * values[s + 1]
        down = earned + discount * values[s - width]
        up = earned + discount * values[s + width]
        total = left + right + down + up
        best = intended * left + (1.0 - intended) * ((total - left) / 3.0)
        best = max(best, intended * right + (1.0 - intended) * ((total - right) / 3.0))
        best = max(best, intended * down + (1.0 - intended) * ((total - down) / 3.0))
        other[s] = max(best, intended * up + (1.0 - intended) * ((total - up) / 3.0))


@kernel
def best_value(s: int, values: Floats, discount: float, intended: float, successor: Integers,
               reward: Floats, slips: Bools) -> float:
    """Highest value of an action in state s, one step ahead of `values[s]` (2.12), (2.22)."""
    total, count, best = 0.0, 0, NOTHING
    for b in range(4):
        if slips[s, b]:
            total += reward[s, b] + discount * values[successor[s, b]]
            count += 1
    for a in range(4):
        if successor[s, a] >= 0:
            meant = reward[s, a] + discount * values[successor[s, a]]
            others = count - 1 if slips[s, a] else count
            slipped = total - meant if slips[s, a] else total
            best = max(best, intended * meant + (1.0 - intended) * (slipped / others)
                       if others > 0 else meant)
    return best
