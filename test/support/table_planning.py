# SPDX-License-Identifier: Apache-2.0
"""Dynamic programming in a `Table`, as plain as it can be, and its outcomes by hand."""

import numpy as np

LOWEST = -1e300  # value of an action that does not exist


def action_values(table, values):
    """Return `q[s, a]` one step ahead of `values[s]`; `LOWEST` where there is no action."""
    worth = table.probability * (table.reward + values[table.successor])
    count = np.diff(table.first)
    q = np.bincount(np.repeat(np.arange(len(count)), count), worth, len(count))
    return np.where(count > 0, q, LOWEST).reshape(-1, len(table.actions))


def can_act(table):
    """Return whether a state has an action."""
    return (np.diff(table.first) > 0).reshape(-1, len(table.actions)).any(axis=1)


def optimal_values(table, sweeps=20_000, tolerance=1e-12):
    """Return `v[s]` of the best policy without a step limit, undiscounted."""
    values, acting = np.zeros(len(table.terminal)), can_act(table)
    for _ in range(sweeps):
        improved = np.where(acting, action_values(table, values).max(axis=1), 0.0)
        if np.abs(improved - values).max() < tolerance:
            return improved
        values = improved
    raise AssertionError('value iteration does not settle')


def policy_values(table, policy, steps):
    """Return `v[s]` of `policy[s]` within so many steps."""
    values, acting = np.zeros(len(table.terminal)), can_act(table)
    for _ in range(steps):
        q = action_values(table, values)
        values = np.where(acting, q[np.arange(len(q)), policy], 0.0)
    return values


def from_starts(table, values):
    """Return the mean of `values[s]` over the starts."""
    return float(values[list(table.starts)].mean())


def outcomes(table, s, action):
    """Return the outcomes of an action as {(successor, reward): probability}."""
    row = s * len(table.actions) + table.actions.index(action)
    found = {}
    for k in range(table.first[row], table.first[row + 1]):
        key = int(table.successor[k]), float(table.reward[k])
        assert key not in found, 'equal outcomes are one outcome'
        found[key] = float(table.probability[k])
    return found
