# SPDX-License-Identifier: Apache-2.0
"""Dynamic programming in a known world: optimal values, and the exact value of a policy."""

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import action_type, World
from comply_ros.world.policy_values_jit import compiled_policy_values
from comply_ros.world.table_planning import (
    ending_policy,
    endless_state,
    table_action_values,
    table_policy_values,
)
from comply_ros.world.transition_table import Table
from comply_ros.world.value_iteration_jit import compiled_value_iteration, has_compiler

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Policy = NDArray[Any]  # int8, or int16 where there are more than 127 actions

TOLERANCE = 1e-10  # value iteration ends when no value changes by so much in a sweep
FINE_TOLERANCE = 1e-13  # of a table: so that actions that are equally good are found to be so
FIRST_LOOK = 1024  # sweeps after which an undiscounted optimum may be found not to be finite
MOST_SWEEPS = 100_000
LARGE = 10_000  # states of a world for which loading the compiler pays
LONG = 1_000_000  # outcomes in all sweeps, for which it pays too
STOP_SHARE = 0.001  # of the first change: the delta of (2.23) in the report


class PlanningError(ArithmeticError):
    """A world without a model, or one whose optimum is not finite; or sweeps without end."""


def action_values(world: World, values: Floats, discount: float = 1.0) -> Floats:
    """
    `q[s, a]` one step ahead of `values[s]` (2.12); -inf where the state has no such action.

    Raises
    ------
    PlanningError: in a world without a model.

    """
    require_model(world)
    if world.model == 'table':
        q = table_action_values(world.table, values, discount)
        return np.where(world.available, q, -np.inf)
    outcome = np.where(world.available, world.reward + discount * values[world.successor], 0.0)
    slips, intended = world.slips, world.grid.intended
    slipped = np.where(slips, outcome, 0.0)
    count = _slip_counts(slips)
    mean = (slipped.sum(axis=1, keepdims=True) - slipped) / np.maximum(count, 1)
    q = np.where(count > 0, intended * outcome + (1.0 - intended) * mean, outcome)
    return np.where(world.available, q, -np.inf)


def _slip_counts(slips: Bools) -> NDArray[np.int64]:
    """Return `count[s, a]` of the moves that action a can become by a slip (2.22), (3.4)."""
    return slips.sum(axis=1, keepdims=True) - slips


def value_iteration(world: World, discount: float = 1.0) -> Iterator[tuple[Floats, float]]:
    """Yield `v[s]` and the largest change of a value, sweep after sweep (2.14), without end."""
    values, free = np.zeros(world.n_states), world.free
    while True:
        improved = np.where(free, action_values(world, values, discount).max(axis=1), 0.0)
        change = float(np.abs(improved - values).max())
        values = improved
        yield values, change


def optimal_values(world: World, discount: float = 1.0) -> Floats:
    """
    `v[s]` of the optimal policy, by value iteration (2.14); 0 where nobody can act.

    The first sweep in which every value changes by less than 1e-10 (in a table, 1e-13 of the
    largest value, if that is above 1) is the last. Large grids are swept in machine code, with
    the same bits.

    Raises
    ------
    PlanningError: if the values still change after 100,000 sweeps, the optimum is found not to
        be finite, or the world has no model.

    """
    if world.model != 'grid':
        return _table_values(world, discount)
    if world.n_states >= LARGE and has_compiler():
        values, change = compiled_value_iteration(world, discount, TOLERANCE, MOST_SWEEPS)
    else:
        for values, change in islice(value_iteration(world, discount), MOST_SWEEPS):
            if change < TOLERANCE:
                break
    if change < TOLERANCE:
        return values
    raise PlanningError(_unsettled(change))


def require_model(world: World) -> None:
    """
    Return if a world has a model to plan with.

    Raises
    ------
    PlanningError: if it has none.

    """
    if world.model == 'none':
        raise PlanningError(
            'planning needs to know what every action leads to, and this world has no model: use '
            'a mentor from a file (file:PATH), from a training (learned:FILE.npz), a person, or a '
            'node of your own')


def _table_values(world: World, discount: float) -> Floats:
    """Return `optimal_values` of a world with a table."""
    change, look = np.inf, FIRST_LOOK
    for number, (values, change) in enumerate(value_iteration(world, discount), 1):
        if change < FINE_TOLERANCE * max(1.0, float(np.abs(values).max())):
            return values
        if number == look and discount == 1.0:
            _require_finite(world, values)
            look *= 4
        if number == MOST_SWEEPS:
            break
    if change < TOLERANCE:
        return values
    raise PlanningError(_unsettled(change))


def _require_finite(world: World, values: Floats) -> None:
    found = endless_state(world.table, values, world.free)
    if found:
        s, growth = found
        what = 'an episode can earn' if growth > 0 else 'every episode loses'
        raise PlanningError(
            f'the best return without discount must be finite, but from state {s} on {what} '
            f'about {abs(growth):.2g} a step without end: let an action there end the episode, or '
            'change a reward')


def _unsettled(change: float) -> str:
    return (f'value iteration must settle within {MOST_SWEEPS} sweeps, '
            f'but a value still changes by {change:.2g}')


def sweeps_until(share: float, changes: Sequence[float]) -> int | None:
    """
    Return the sweeps after which value iteration stops by (2.23), or None.

    share: of the first change that a later one must fall below. changes: largest change of a
    value in each sweep.
    """
    for number, change in enumerate(changes, 1):
        if change < share * changes[0]:
            return number
    return None


def greedy(q: Floats, free: Bools) -> Policy:
    """`policy[s]`: the first best action (2.13), (3.5); -1 where nobody can act."""
    return np.where(free, q.argmax(axis=1), NO_ACTION).astype(action_type(q.shape[1]))


def state_values(q: Floats, free: Bools) -> Floats:
    """`v[s]` of the best action in state s; 0 where nobody can act."""
    return np.where(free, q.max(axis=1), 0.0)


def optimal_policy(world: World) -> Policy:
    """
    `policy[s]`: greedy towards the optimal values, discount 1.

    In a table, of actions that are equally good, one that ends the episode: see `ending_policy`.
    """
    q = action_values(world, optimal_values(world))
    if world.model == 'table':
        policy = np.where(world.free, ending_policy(world.table, q), NO_ACTION)
        return policy.astype(world.action_type)
    return greedy(q, world.free)


def uniform_probabilities(world: World) -> Floats:
    """`pi[s, a]` of the random policy: every action of a state, equally likely."""
    return world.available / np.maximum(world.available.sum(axis=1, keepdims=True), 1)


def policy_probabilities(world: World, policy: Policy) -> Floats:
    """`pi[s, a]` of `policy[s]`; without advice (-1), every action is equally likely."""
    certain = policy[:, None] == np.arange(world.n_actions)
    is_silent = (policy == NO_ACTION)[:, None]
    return np.where(is_silent, uniform_probabilities(world), certain)


def policy_values(world: World, pi: Floats) -> Floats:
    """
    `v[s]`: exact expected return of `pi[s, a]` from s, undiscounted, over the step limit.

    Policy evaluation (2.11), one sweep a step: nothing is sampled.

    Raises
    ------
    PlanningError: in a world without a model.

    """
    require_model(world)
    if world.model == 'table':
        return table_policy_values(world.table, pi)
    slips, intended = world.slips, world.grid.intended
    count = _slip_counts(slips)
    as_meant = np.where(count > 0, intended * pi, pi)
    slipping = np.where(count > 0, (1.0 - intended) * pi / np.maximum(count, 1), 0.0)
    slipped = slips * (slipping.sum(axis=1, keepdims=True) - slipping)
    happens = np.where(world.free[:, None], as_meant + slipped, 0.0)  # P(move b | s), [s, b]
    earned = (happens * world.reward).sum(axis=1)
    values = np.zeros(len(earned))
    for _ in range(world.step_limit):
        values = earned + np.einsum('sb,sb->s', happens, values[world.successor])
    return values


def expected_return(world: World, pi: Floats) -> float:
    """
    Exact expected return of `pi[s, a]` from the starts, as in `policy_values`.

    A large table is evaluated in machine code, in the states that the policy reaches, with the
    same bits.
    """
    if world.model == 'table' and _is_long(world.table) and has_compiler():
        values = compiled_policy_values(world.table, pi)
    else:
        values = policy_values(world, pi)
    return float(values[world.starts].mean())


def _is_long(table: Table) -> bool:
    """Whether evaluating a policy takes so long that loading the compiler pays."""
    return len(table.successor) * table.step_limit >= LONG


class ReferenceReturns:
    """
    The returns that a mentor and a learner are measured against.

    Attributes
    ----------
    world: the `World`.
    optimal_return, random_return: exact expected returns from the starts over the step limit.

    """

    def __init__(self, world: World) -> None:
        self.world = world
        self.optimal_return = self.return_of(optimal_policy(world))
        self.random_return = expected_return(world, uniform_probabilities(world))

    def return_of(self, policy: Policy) -> float:
        """Exact expected return of `policy[s]`."""
        return expected_return(self.world, policy_probabilities(self.world, policy))

    def optimality(self, policy_return: float) -> float | None:
        """
        Level of a return: 0 for the random policy, 1 for the optimal one (section 4.3.1).

        None in a world where the random policy is optimal.
        """
        span = self.optimal_return - self.random_return
        return (policy_return - self.random_return) / span if span else None
