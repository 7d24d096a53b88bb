# SPDX-License-Identifier: Apache-2.0
"""The grid world as a Markov decision process in arrays, and one move in it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.numerics.jit import kernel
from comply_ros.world.grid import GOAL, Grid, NO_ACTION, OBSTACLE, STEPS


class World:
    """
    The arrays of a grid's MDP.

    Attributes
    ----------
    grid: the `Grid` that it was made from.
    successor: `successor[s, b]`, int32: where move b leads from s, -1 where there is no such move.
    available: `available[s, b]`, bool: whether there is one.
    reward: `reward[s, b]`, float64: what that move earns.
    slips: `slips[s, b]`, bool: whether a slip in s can become move b.
    terminal: `terminal[s]`, bool: true at a goal.
    obstacle: `obstacle[s]`, bool.
    free: `free[s]`, bool: where an agent can act. Free cells of the map from which no goal can be
        reached are left out: no start leads to them either.
    starts: int32: the states in which an episode can start.
    begins: `begins[s]`, bool: whether s is one of them.

    """

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        cells = np.frombuffer(grid.cells.encode(), dtype='S1')
        self.terminal = cells == GOAL.encode()
        self.obstacle = cells == OBSTACLE.encode()
        self.free = grid.can_reach_goal & ~self.terminal
        self.starts = np.array(grid.starts, dtype=np.int32)
        self.begins = np.zeros(len(cells), dtype=bool)
        self.begins[self.starts] = True
        self.successor = np.full((len(cells), len(STEPS)), -1, dtype=np.int32)
        self.reward = np.zeros((len(cells), len(STEPS)))
        for action in range(len(STEPS)):
            self._add_moves(action)
        self.available = self.successor >= 0
        leaves = self.successor != np.arange(len(cells))[:, None]
        self.slips = self.available & (grid.slips_bump | leaves)

    def _add_moves(self, action: int) -> None:
        """Change successor and reward: fill in the column of one action."""
        grid, (dx, dy) = self.grid, STEPS[action]
        s = np.arange(len(self.terminal), dtype=np.int32)
        x, y = s % grid.width + dx, s // grid.width + dy
        exists = (0 <= x) & (x < grid.width) & (0 <= y) & (y < grid.height)
        target = np.where(exists, y * grid.width + x, 0)
        bumps = self.obstacle[target]
        earned = np.where(self.terminal[target], grid.goal_reward, grid.step_reward)
        self.reward[:, action] = np.where(bumps, grid.obstacle_reward, earned)
        self.successor[:, action] = np.where(exists, np.where(bumps, s, target), NO_ACTION)

    def leads(self, s: int, s2: int) -> bool:
        """Whether a move leads from s to s2."""
        return s2 in self.successor[s].tolist()


@kernel
def taken_action(s: int, a: int, u: float, intended: float, slips: NDArray[np.bool_]) -> int:
    """
    Return the action that really happens when a is meant in state s: (2.22), (3.4).

    u: uniform in [0, 1). Below `intended` the move is as meant; the rest of the interval is
    shared evenly by the other actions that a slip can become.
    """
    if u < intended:
        return a
    others = 0
    for b in range(4):
        if b != a and slips[s, b]:
            others += 1
    if others == 0:
        return a
    pick = min(int((u - intended) / (1.0 - intended) * others), others - 1)
    for b in range(4):
        if b != a and slips[s, b]:
            if pick == 0:
                return b
            pick -= 1
    return a


@kernel
def first_state(u: float, starts: Any) -> int:
    """State in which an episode starts: one of `starts`, equally likely. u: uniform in [0, 1)."""
    return starts[min(int(u * len(starts)), len(starts) - 1)]
