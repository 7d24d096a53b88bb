# SPDX-License-Identifier: Apache-2.0
"""Planning in a `Table`: sums over outcomes, optima that are not finite, policies that end."""

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.transition_table import Table

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

TIE = 1e-9  # actions whose values differ by at most this are equally good
LAZY_SWEEPS = 1000  # sweeps before `endless_state` looks
MOST_TIME_SWEEPS = 100_000
SETTLED = 1e-12  # of the longest time to an end
GROWTH = 1e-6  # change of a value in a sweep that is no rounding


def table_action_values(table: Table, values: Floats, discount: float) -> Floats:
    """`q[s, a]` one step ahead of `values[s]` (2.12); 0 where the state has no such action."""
    worth = table.probability * (table.reward + discount * values[table.successor])
    sums = np.bincount(table.pairs, worth, minlength=len(table.first) - 1)
    return np.where(table.available, sums.reshape(table.available.shape), 0.0)


def table_policy_values(table: Table, pi: Floats) -> Floats:
    """`v[s]`: expected return of `pi[s, a]` over the step limit: (2.11), one sweep a step."""
    likely = np.where(table.available, pi, 0.0).ravel()[table.pairs] * table.probability
    happens = np.flatnonzero(likely)
    likely, successor = likely[happens], table.successor[happens]
    state = table.pairs[happens] // len(table.actions)
    earned = np.bincount(state, likely * table.reward[happens], minlength=table.n_states)
    values = np.zeros(table.n_states)
    for _ in range(table.step_limit):
        before, values = values, np.add(earned, np.bincount(
            state, likely * values[successor], minlength=table.n_states))
        if (values == before).all():
            break  # further sweeps have the same bits
    return values


def ending_policy(table: Table, q: Floats) -> NDArray[np.intp]:
    """
    `policy[s]`: of the best actions of `q[s, a]`, those that end the episode soonest.

    Where several actions are equally good, the first ones may go round in a circle for ever, or
    come to an end only after very many steps. So among them, the expected number of steps to a
    terminal state is made as small as can be; of what is equally good then, it is the first. If no
    choice among the best actions is certain to end, one that may end is taken, or else the first.
    """
    tied = table.available & _nearly_highest(q)
    policy, ends = _leading_policy(table, tied)
    while True:  # leave out actions that can lead to where an end is not certain
        safe = tied & ~_can_lead(table, tied, ~ends)
        found, reached = _leading_policy(table, safe)
        if (reached == ends).all():
            break
        tied, ends = safe, reached
    certain = ends & ~table.terminal
    policy = np.where(certain, found, policy)
    if certain.any():
        soonest = _nearly_highest(-_steps_to_end(table, safe, certain)).argmax(axis=1)
        policy = np.where(certain, soonest, policy)
    return policy


def _nearly_highest(q: Floats) -> Bools:
    """Whether each `q[s, a]` is the highest of its state, or as good but for rounding."""
    best = q.max(axis=1, keepdims=True)
    return q >= best - TIE * np.maximum(1.0, np.abs(best))


def _can_lead(table: Table, among: Bools, to: Bools) -> Bools:
    """Whether each of the actions `among[s, a]` can lead to one of the states `to[s]`."""
    leads = np.zeros(among.size, dtype=bool)
    leads[table.pairs[to[table.successor]]] = True
    return among & leads.reshape(among.shape)


def _leading_policy(table: Table, among: Bools) -> tuple[NDArray[np.intp], Bools]:
    """
    Return `policy[s]` that may end the episode, and from which states it may.

    States are gone through backwards from the terminal ones: each takes the first of the actions
    `among[s, a]` that can lead to a state that is nearer to an end.
    """
    policy, ends = among.argmax(axis=1), table.terminal.copy()
    while True:
        leads = _can_lead(table, among, ends)
        newest = leads.any(axis=1) & ~ends
        if not newest.any():
            return policy, ends
        policy[newest] = leads[newest].argmax(axis=1)
        ends |= newest


def _steps_to_end(table: Table, among: Bools, certain: Bools) -> Floats:
    """`steps[s, a]`: fewest expected steps to an end by the actions `among[s, a]`; else inf."""
    steps = np.zeros(table.n_states)
    for _ in range(MOST_TIME_SWEEPS):
        sums = np.bincount(table.pairs, table.probability * (1.0 + steps[table.successor]),
                           minlength=among.size).reshape(among.shape)
        q = np.where(among, sums, np.inf)
        improved = np.where(certain, q.min(axis=1), 0.0)
        change = np.abs(improved - steps).max()
        steps = improved
        if change < SETTLED * steps.max():
            break
    return q


def endless_state(table: Table, values: Floats, free: Bools) -> tuple[int, float] | None:
    """
    Return a state whose undiscounted optimum is not finite, and its growth in a sweep, or None.

    It is one of a set of states that no episode leaves, if the agent acts as is best for it, or
    whatever it does, and that earn or cost in every sweep of value iteration.

    Parameters
    ----------
    values: `v[s]` after many sweeps. To them, sweeps are added that go half the way: they have
        the same optimum, and do not swing where a cycle earns in some steps only.
    free: `free[s]`: where an agent can act.

    """
    for _ in range(LAZY_SWEEPS):
        values = (values + _swept(table, values, free)) / 2.0
    q = np.where(table.available, table_action_values(table, values, 1.0), -np.inf)
    growth = np.where(free, q.max(axis=1), 0.0) - values
    best = np.zeros_like(table.available)
    best[np.arange(table.n_states), q.argmax(axis=1)] = True
    for grows, taken in ((growth > GROWTH, best), (growth < -GROWTH, table.available)):
        inside = _closed(table, grows & free, taken)
        if inside.any():
            s = int(np.flatnonzero(inside)[0])
            return s, float(growth[s])
    return None


def _swept(table: Table, values: Floats, free: Bools) -> Floats:
    q = np.where(table.available, table_action_values(table, values, 1.0), -np.inf)
    return np.where(free, q.max(axis=1), 0.0)


def _closed(table: Table, inside: Bools, taken: Bools) -> Bools:
    """Return the largest part of a set of states that the actions `taken[s, a]` do not leave."""
    outcomes = np.flatnonzero((taken & table.available).ravel()[table.pairs])
    state = table.pairs[outcomes] // len(table.actions)
    successor = table.successor[outcomes]
    while True:
        leaves = np.zeros_like(inside)
        leaves[state[~inside[successor]]] = True
        if not (leaves & inside).any():
            return inside
        inside = inside & ~leaves
