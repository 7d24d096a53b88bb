# SPDX-License-Identifier: Apache-2.0
"""What follows from a known world: optimal values, and the exact value of a policy."""

import numpy as np

from comply_ros.core.grid import NO_ACTION

TOLERANCE = 1e-10  # largest change of a value in the last sweep of value iteration
MOST_SWEEPS = 100_000


class PlanningError(ArithmeticError):
    """Value iteration that does not settle."""


def action_values(world, values, discount=1.0):
    """
    `q[s, a]` one step ahead of `values[s]` (2.12); -inf where the cell has no such action.

    The other actions of the cell share what is left of the intended probability: (2.22), (3.4).
    """
    available, intended = world.available, world.grid.intended
    outcome = np.where(available, world.reward + discount * values[world.successor], 0.0)
    others = available.sum(axis=1, keepdims=True) - 1
    slipped = (outcome.sum(axis=1, keepdims=True) - outcome) / np.maximum(others, 1)
    q = np.where(others > 0, intended * outcome + (1.0 - intended) * slipped, outcome)
    return np.where(available, q, -np.inf)


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

    Raises
    ------
    PlanningError: if the values still change after 100,000 sweeps.

    """
    for _, (values, change) in zip(range(MOST_SWEEPS), value_iteration(world, discount)):
        if change < TOLERANCE:
            return values
    raise PlanningError(f'value iteration must settle within {MOST_SWEEPS} sweeps, '
                        f'but a value still changes by {change:.2g}')


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
    available, intended = world.available, world.grid.intended
    others = available.sum(axis=1, keepdims=True) - 1
    slipped = available * (pi.sum(axis=1, keepdims=True) - pi) / np.maximum(others, 1)
    happens = np.where(others > 0, intended * pi + (1.0 - intended) * slipped, pi)
    return np.where(world.free[:, None], happens, 0.0)


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


class Yardstick:
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
