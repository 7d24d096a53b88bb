# SPDX-License-Identifier: Apache-2.0
"""Garnets: random worlds, each made from a number (Archibald, McKinnon and Thomas, 1995)."""

import numpy as np
from numpy.typing import NDArray

from comply_ros.numerics.rng import SEED_LIMIT
from comply_ros.world.grid import MapError
from comply_ros.world.transition_table import Table

SIZES = (50, 200, 800)  # numbers of states, by the remainder of the seed
ACTIONS = ('0', '1', '2', '3')
SUCCESSORS = 3  # of each action
STEP_REWARD, BAD_REWARD, GOAL_REWARD = -0.1, -5.0, 10.0
STATES_FOR_A_BAD_ONE = 10
STEP_LIMIT = 320


def garnet_table(seed: int) -> Table:
    """
    World of 50, 200 or 800 states, drawn from a seed; the same seed gives the same world.

    Each of four actions leads to three states, drawn anew for each action, with the chances of
    Dirichlet(1, 1, 1). An episode starts in the first state and ends in the last one, which can
    be reached from every state. A step earns -0.1, one into a tenth of the states -5, one into
    the last state 10.

    Parameters
    ----------
    seed: of all draws; the number of states is that of `seed % 3` in `SIZES`.

    Raises
    ------
    MapError: unless the seed lies in [0, 2^53].

    """
    if not 0 <= seed <= SEED_LIMIT:
        raise MapError(f'the seed of a Garnet must lie in [0, {SEED_LIMIT}], got {seed}')
    states = SIZES[seed % len(SIZES)]
    generator = np.random.Generator(np.random.PCG64(seed))
    successor, probability = _outcomes(states, generator)
    while not reaches_last(successor):
        successor, probability = _outcomes(states, generator)
    reward = np.full(states, STEP_REWARD)
    between = generator.permutation(states - 2) + 1  # neither the start nor the goal
    reward[between[:states // STATES_FOR_A_BAD_ONE]] = BAD_REWARD
    reward[-1] = GOAL_REWARD
    flat = successor.astype(np.int32).ravel()
    return Table(
        ACTIONS, np.arange(states * len(ACTIONS) + 1, dtype=np.int64) * SUCCESSORS, flat,
        probability.ravel(), reward[flat], np.arange(states) == states - 1, (0,), STEP_LIMIT)


def _outcomes(states: int, generator: np.random.Generator,
              ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return `successor[s, a, k]` and `probability[s, a, k]` of all actions."""
    successor = np.array([[generator.choice(states, SUCCESSORS, replace=False) for _ in ACTIONS]
                          for _ in range(states)])
    return successor, generator.dirichlet(np.ones(SUCCESSORS), (states, len(ACTIONS)))


def reaches_last(successor: NDArray[np.int64]) -> bool:
    """
    Tell whether every state can reach the last one.

    successor: `successor[s, a, k]`, the states that an action can lead to.
    """
    reached = np.arange(len(successor)) == len(successor) - 1
    while True:
        more = reached | reached[successor].any(axis=(1, 2))
        if (more == reached).all():
            return bool(reached.all())
        reached = more
