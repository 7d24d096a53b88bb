# SPDX-License-Identifier: Apache-2.0
"""Policy evaluation of a `Table` in machine code: the bits of numpy, in a fraction of the time."""

import numpy as np
from numpy.typing import NDArray

from comply_ros.numerics.jit import kernel, run_compiled
from comply_ros.world.transition_table import Table

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Bools = NDArray[np.bool_]


def compiled_policy_values(table: Table, pi: Floats) -> Floats:
    """
    `v[s]`: expected return of `pi[s, a]` over the step limit: (2.11), one sweep a step.

    It is 0 in states that no start leads to by these actions.
    """
    chances = np.where(table.available, pi, 0.0)
    states, starts = table.n_states, np.array(table.starts, dtype=np.int64)
    order, found = np.empty(states, dtype=np.int64), np.zeros(states, dtype=bool)
    begin = np.empty(states + 1, dtype=np.int64)
    successor, earned = np.empty(len(table.successor), dtype=np.int64), np.empty(states)
    likely, values, other = np.empty(len(successor)), np.zeros(states), np.zeros(states)
    count = run_compiled(follow_policy, chances, table.first, table.successor, table.probability,
                         table.reward, starts, order, found, begin, successor, likely, earned)
    sweeps = run_compiled(sweep_steps, values, other, table.step_limit, order[:count], begin,
                          successor, likely, earned)
    return other if sweeps % 2 else values


@kernel
def follow_policy(chances: Floats, first: Integers, outcome: NDArray[np.int32],
                  probability: Floats, reward: Floats, starts: Integers, order: Integers,
                  found: Bools, begin: Integers, successor: Integers, likely: Floats,
                  earned: Floats) -> int:
    """
    Change the last six arrays to what happens under a policy; return how many states it reaches.

    Parameters
    ----------
    chances: `pi[s, a]`, 0 where a state has no such action.
    first, outcome, probability, reward: of a `Table`.
    order: the states that are reached, in the order of their first visit.
    found: `found[s]`: whether state s is one of them; all false.
    begin: `begin[i]`: where the outcomes of `order[i]` begin in the next two arrays.
    successor, likely: of each outcome that happens, the state and the probability.
    earned: `earned[i]`: expected reward of a step in `order[i]`.

    """
    count = 0
    for s in starts:
        if not found[s]:
            found[s], order[count] = True, s
            count += 1
    i = size = 0
    while i < count:
        s, begin[i], sum_of_rewards = order[i], size, 0.0
        for a in range(chances.shape[1]):
            if chances[s, a] == 0.0:
                continue
            pair = s * chances.shape[1] + a
            for k in range(first[pair], first[pair + 1]):
                chance, s2 = chances[s, a] * probability[k], outcome[k]
                if chance == 0.0:
                    continue
                sum_of_rewards += chance * reward[k]
                successor[size], likely[size] = s2, chance
                size += 1
                if not found[s2]:
                    found[s2], order[count] = True, s2
                    count += 1
        earned[i] = sum_of_rewards
        i += 1
    begin[count] = size
    return count


@kernel
def sweep_steps(values: Floats, other: Floats, steps: int, order: Integers, begin: Integers,
                successor: Integers, likely: Floats, earned: Floats) -> int:
    """
    Change values by a sweep of policy evaluation a step, until there are no more or none changes.

    Return the number of sweeps; after an odd one `other[s]` has the newest values. Parameters are
    as in `follow_policy`; values, other: `v[s]`, both 0.
    """
    for number in range(steps):
        settled = True
        for i in range(len(order)):
            s, following = order[i], 0.0
            for k in range(begin[i], begin[i + 1]):
                following += likely[k] * values[successor[k]]
            other[s] = earned[i] + following
            settled = settled and other[s] == values[s]
        if settled:
            return number + 1
        values, other = other, values
    return steps
