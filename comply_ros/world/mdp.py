# SPDX-License-Identifier: Apache-2.0
"""The grid world as a Markov decision process in arrays, and one move in it."""

import numpy as np

from comply_ros.numerics.jit import kernel
from comply_ros.world.grid import GOAL, NO_ACTION, OBSTACLE, STEPS


class World:
    """
    The arrays of a grid's MDP.

    Attributes
    ----------
    grid: the `Grid` that it was made from.
    successor: `successor[s, b]`, int32: where move b leads from s, -1 where there is no such move.
    available: `available[s, b]`, bool: whether there is one. Made once: a look at one move of a
        large world must not cost a look at all of them.
    reward: `reward[s, b]`, float64: what that move earns.
    slips: `slips[s, b]`, bool: whether a move that goes astray in s can become b.
    terminal: `terminal[s]`, bool: True at a goal.
    obstacle: `obstacle[s]`, bool.
    free: `free[s]`, bool: True where an agent can come to stand and act. A free cell from which
        no way leads to a goal is none: no way leads there from a start either.
    starts: int32: the states in which an episode can begin.
    begins: `begins[s]`, bool: whether s is one of them.

    """

    def __init__(self, grid):
        self.grid = grid
        cells = np.frombuffer(grid.cells.encode(), dtype='S1')
        self.terminal = cells == GOAL.encode()
        self.obstacle = cells == OBSTACLE.encode()
        self.free = grid.arriving & ~self.terminal
        self.starts = np.array(grid.starts, dtype=np.int32)
        self.begins = np.zeros(len(cells), dtype=bool)
        self.begins[self.starts] = True
        self.successor = np.full((len(cells), len(STEPS)), -1, dtype=np.int32)
        self.reward = np.zeros((len(cells), len(STEPS)))
        for action in range(len(STEPS)):
            self._add_moves(action)
        self.available = self.successor >= 0
        somewhere = self.successor != np.arange(len(cells))[:, None]
        self.slips = self.available & (grid.slips_bump | somewhere)

    def _add_moves(self, action):
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

    def leads(self, s, s2):
        """Tell whether some move leads from s to s2."""
        return s2 in self.successor[s].tolist()


@kernel
def taken_action(s, a, u, intended, slips):
    """
    Return the action that really happens when a is meant in state s: (2.22), (3.4).

    u: uniform in [0, 1). Below `intended` the move is as meant; the rest of the interval is
    shared evenly by the other actions that it can become.
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
def first_state(u, starts):
    """Start of an episode: one of `starts`, equally likely. u: uniform in [0, 1)."""
    return starts[min(int(u * len(starts)), len(starts) - 1)]
