# SPDX-License-Identifier: Apache-2.0
"""What follows from a known world: optimal values, and the exact value of a policy."""

import numpy as np

from comply_ros.world.grid import NO_ACTION
from comply_ros.world.value_iteration_jit import can_be_compiled, settled_values

TOLERANCE = 1e-10  # largest change of a value in the last sweep of value iteration
MOST_SWEEPS = 100_000
MANY = 10_000  # states for which it is worth the while to load the compiler
STOP_SHARE = 0.001  # of the first change: the delta of (2.23) in the report


class PlanningError(ArithmeticError):
    """Value iteration that does not settle."""


def action_values(world, values, discount=1.0):
    """
    `q[s, a]` one step ahead of `values[s]` (2.12); -inf where the cell has no such action.

    The other moves that it can become share the rest of the probability: (2.22), (3.4).
    """
    outcome = np.where(world.available, world.reward + discount * values[world.successor], 0.0)
    return np.where(world.available, astray(world, outcome, outcome), -np.inf)


def astray(world, meant, others):
    """
    Return `mean[s, a]` of what happens if a is meant: `meant[s, a]`, or by a slip `others[s, b]`.

    Where a move cannot go astray it is always as meant.
    """
    slips, intended = world.slips, world.grid.intended
    total = np.where(slips, others, 0.0).sum(axis=1, keepdims=True) - np.where(slips, others, 0.0)
    count = slips.sum(axis=1, keepdims=True) - slips
    slipped = total / np.maximum(count, 1)
    return np.where(count > 0, intended * meant + (1.0 - intended) * slipped, meant)


def value_iteration(world, discount=1.0):
    """Yield `v[s]` and the largest change of a value, sweep after sweep (2.14), without end."""
    values, free = np.zeros(len(world.terminal)), world.free
    while True:
        improved = np.where(free, action_values(world, values, discount).max(axis=1), 0.0)
        change = float(np.abs(improved - values).max())
        values = improved
        yield values, change


def optimal_values(world, discount=1.0):
    """
    `v[s]` of the optimal policy, by value iteration (2.14); 0 in terminal and obstacle cells.

    The first sweep in which every value changes by less than 1e-10 is the last. Large worlds are
    swept in machine code, with the same bits.

    Raises
    ------
    PlanningError: if the values still change after 100,000 sweeps.

    """
    if len(world.free) >= MANY and can_be_compiled():
        values, change = settled_values(world, discount, TOLERANCE, MOST_SWEEPS)
    else:
        values, change = _first_settled(value_iteration(world, discount))
    if change < TOLERANCE:
        return values
    raise PlanningError(f'value iteration must settle within {MOST_SWEEPS} sweeps, '
                        f'but a value still changes by {change:.2g}')


def _first_settled(iteration):
    """Return values and change of the first sweep that settles, or of the last one allowed."""
    for _, (values, change) in zip(range(MOST_SWEEPS), iteration):
        if change < TOLERANCE:
            break
    return values, change


def sweeps_until(share, changes):
    """
    Return the sweeps after which value iteration stops by (2.23), or None.

    share: of the first change that a later one must fall below. changes: largest change of a
    value in each sweep.
    """
    for number, change in enumerate(changes, 1):
        if change < share * changes[0]:
            return number
    return None


def greedy(q, free):
    """`policy[s]`, int8: the first best action (2.13), (3.5); -1 where there is nothing to do."""
    return np.where(free, q.argmax(axis=1), NO_ACTION).astype(np.int8)


def state_values(q, free):
    """`v[s]`, float64: of the best action in state s; 0 where there is nothing to do."""
    return np.where(free, q.max(axis=1), 0.0)


def optimal_policy(world):
    """`policy[s]`, int8: greedy towards the optimal values, discount 1."""
    return greedy(action_values(world, optimal_values(world)), world.free)


def uniform_probabilities(world):
    """`pi[s, a]` of the random policy: every action that the cell has, equally likely."""
    return world.available / world.available.sum(axis=1, keepdims=True)


def probabilities(world, policy):
    """`pi[s, a]` of `policy[s]`; where it says nothing (-1), every action is equally likely."""
    certain = policy[:, None] == np.arange(4)
    silent = (policy == NO_ACTION)[:, None]
    return np.where(silent, uniform_probabilities(world), certain)


def chances(world, pi):
    """`chance[s, b]` that move b really happens under `pi[s, a]`; 0 where nobody can act."""
    slips, intended = world.slips, world.grid.intended
    count = slips.sum(axis=1, keepdims=True) - slips
    kept = np.where(count > 0, intended * pi, pi)
    leaving = np.where(count > 0, (1.0 - intended) * pi / np.maximum(count, 1), 0.0)
    arriving = slips * (leaving.sum(axis=1, keepdims=True) - leaving)
    return np.where(world.free[:, None], kept + arriving, 0.0)


def values_of(world, pi):
    """
    `v[s]`: exact expected return of `pi[s, a]` from s, undiscounted, over the step limit.

    Policy evaluation (2.11), one sweep a step: nothing is sampled.
    """
    chance = chances(world, pi)
    earned = (chance * world.reward).sum(axis=1)
    values = np.zeros(len(earned))
    for _ in range(world.grid.step_limit):
        values = earned + np.einsum('sb,sb->s', chance, values[world.successor])
    return values


def expected_return(world, pi):
    """Exact expected return of `pi[s, a]` from the starts, as in `values_of`."""
    return float(values_of(world, pi)[world.starts].mean())


class ReferenceReturns:
    """
    The returns that a mentor and a learner are measured against.

    Attributes
    ----------
    optimal_return, random_return: exact expected returns from the starts over the step limit.

    """

    def __init__(self, world):
        self.world = world
        self.optimal_return = expected_return(world, probabilities(world, optimal_policy(world)))
        self.random_return = expected_return(world, uniform_probabilities(world))

    def return_of(self, policy):
        """Exact expected return of `policy[s]`."""
        return expected_return(self.world, probabilities(self.world, policy))

    def optimality(self, policy_return):
        """
        Level of a return: 0 for the random policy, 1 for the optimal one (section 4.3.1).

        None in a world where the random policy is optimal.
        """
        span = self.optimal_return - self.random_return
        return (policy_return - self.random_return) / span if span else None
