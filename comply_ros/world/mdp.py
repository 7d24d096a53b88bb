# SPDX-License-Identifier: Apache-2.0
"""A world as a Markov decision process in arrays, and one move in it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from comply_ros.numerics.action_values import Actions, actions_for_kernels, count_actions
from comply_ros.numerics.jit import kernel
from comply_ros.world.grid import ACTION_NAMES, GOAL, Grid, NO_ACTION, OBSTACLE, STEPS
from comply_ros.world.state_action_spaces import Spaces
from comply_ros.world.transition_table import Table

Bools = NDArray[np.bool_]
Source = Grid | Table | Spaces  # what a `World` can be made from


class WorldArrays(NamedTuple):
    """
    What kernels need of a `World`; arrays that it does not use have no elements.

    has_table: one element for a table and none for a grid: a length that the compiler knows, so
    that each has machine code of its own.
    """

    successor: Any
    reward: Any
    slips: Any
    first: Any
    outcome: Any
    outcome_reward: Any
    probability: Any
    terminal: Any
    starts: Any
    intended: float
    step_limit: int
    actions: Actions
    has_table: tuple[int, ...]


class World:
    """
    The arrays of a world's MDP.

    Attributes
    ----------
    source: the `Grid`, `Table` or `Spaces` that it was made from.
    model: `grid` or `table`; `none` where nobody knows what an action leads to.
    n_states, n_actions: numbers of states and actions.
    action_names: the names of the actions.
    action_type: type of arrays of actions: int8, or int16 where there are more than 127.
    step_limit: number of steps after which an episode is truncated.
    sha256: hash of the source: equal hashes mean equal worlds.
    available: `available[s, b]`, bool: whether state s has action b.
    terminal: `terminal[s]`, bool: whether an episode ends in s. Without a model it is not known
        in which it does, and false everywhere.
    obstacle: `obstacle[s]`, bool: of a grid.
    free: `free[s]`, bool: where an agent can act. Free cells of a grid from which no goal can be
        reached are left out, and so are states of a table that no start leads to.
    starts: int32: the states in which an episode can start; none without a model.
    begins: `begins[s]`, bool: whether s is one of them.
    successor: `successor[s, b]`, int32, of a grid: where move b leads from s, -1 where there is
        no such move.
    reward: `reward[s, b]`, float64, of a grid: what that move earns.
    slips: `slips[s, b]`, bool, of a grid: whether a slip in s can become move b.

    """

    model: str
    action_names: tuple[str, ...]
    available: Bools
    terminal: Bools
    obstacle: Bools
    free: Bools
    starts: NDArray[np.int32]
    successor: NDArray[np.int32]
    reward: NDArray[np.float64]
    slips: Bools

    def __init__(self, source: Source) -> None:
        self.source, self.step_limit = source, source.step_limit
        if isinstance(source, Grid):
            self.action_names = ACTION_NAMES
            self._use_grid(source)
        else:
            self.action_names = source.actions
            self._use_table(source) if isinstance(source, Table) else self._use_spaces(source)
        self.n_states, self.n_actions = self.available.shape
        self.action_type: DTypeLike = action_type(self.n_actions)
        self.begins = np.zeros(self.n_states, dtype=bool)
        self.begins[self.starts] = True

    @property
    def grid(self) -> Grid:
        """The `Grid` that it was made from; raises a TypeError if that was none."""
        if not isinstance(self.source, Grid):
            raise TypeError(f'a {type(self.source).__name__} has no grid')
        return self.source

    @property
    def table(self) -> Table:
        """The `Table` that it was made from; raises a TypeError if that was none."""
        if not isinstance(self.source, Table):
            raise TypeError(f'a {type(self.source).__name__} has no table')
        return self.source

    @property
    def sha256(self) -> str:
        """SHA-256 (hex) of the source."""
        return self.source.sha256

    @property
    def positions(self) -> NDArray[np.float64] | None:
        """`positions[s]`: x and y in metres of a table that has them; None in other worlds."""
        return self.source.positions if isinstance(self.source, Table) else None

    def _use_grid(self, grid: Grid) -> None:
        self.model = 'grid'
        cells = np.frombuffer(grid.cells.encode(), dtype='S1')
        self.terminal = cells == GOAL.encode()
        self.obstacle = cells == OBSTACLE.encode()
        self.free = grid.can_reach_goal & ~self.terminal
        self.starts = np.array(grid.starts, dtype=np.int32)
        self.successor = np.full((len(cells), len(STEPS)), -1, dtype=np.int32)
        self.reward = np.zeros((len(cells), len(STEPS)))
        for action in range(len(STEPS)):
            self._add_moves(grid, action)
        self.available = self.successor >= 0
        leaves = self.successor != np.arange(len(cells))[:, None]
        self.slips = self.available & (grid.slips_bump | leaves)

    def _use_table(self, table: Table) -> None:
        self.model, self.terminal, self.available = 'table', table.terminal, table.available
        self.free = table.reachable & ~table.terminal
        self.starts = np.array(table.starts, dtype=np.int32)
        self._use_no_grid()

    def _use_spaces(self, spaces: Spaces) -> None:
        self.model, self.terminal = 'none', np.zeros(spaces.n_states, dtype=bool)
        self.available = np.ones((spaces.n_states, len(spaces.actions)), dtype=bool) \
            if spaces.available is None else spaces.available
        self.free = np.logical_or.reduce(self.available, axis=1)
        self.starts = np.zeros(0, dtype=np.int32)
        self._use_no_grid()

    def _use_no_grid(self) -> None:
        states, n_actions = self.available.shape
        self.obstacle = np.zeros(states, dtype=bool)
        self.successor = np.zeros((0, n_actions), dtype=np.int32)
        self.reward, self.slips = np.zeros((0, n_actions)), np.zeros((0, n_actions), dtype=bool)

    def _add_moves(self, grid: Grid, action: int) -> None:
        """Change successor and reward: fill in the column of one action."""
        dx, dy = STEPS[action]
        s = np.arange(len(self.terminal), dtype=np.int32)
        x, y = s % grid.width + dx, s // grid.width + dy
        exists = (0 <= x) & (x < grid.width) & (0 <= y) & (y < grid.height)
        target = np.where(exists, y * grid.width + x, 0)
        bumps = self.obstacle[target]
        earned = np.where(self.terminal[target], grid.goal_reward, grid.step_reward)
        self.reward[:, action] = np.where(bumps, grid.obstacle_reward, earned)
        self.successor[:, action] = np.where(exists, np.where(bumps, s, target), NO_ACTION)

    def leads(self, s: int, s2: int) -> bool:
        """Whether an action can lead from s to s2; without a model, it always can."""
        if self.model == 'table':
            first = self.table.first
            begin, end = first[s * self.n_actions], first[(s + 1) * self.n_actions]
            return s2 in self.table.successor[begin:end].tolist()
        return self.model == 'none' or s2 in self.successor[s].tolist()

    def arrays(self) -> WorldArrays:
        """
        Return what kernels need; no array is copied, but for `starts`.

        Its int64 makes every state one in compiled code: for states of int32 and of int64, each
        kernel is compiled twice.
        """
        if self.model == 'table':
            table = self.table
            outcomes = table.first, table.successor, table.reward, table.probability
        else:
            outcomes = (np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int32), np.zeros(0),
                        np.zeros(0))
        intended = float(self.grid.intended) if self.model == 'grid' else 1.0
        return WorldArrays(
            self.successor, self.reward, self.slips, *outcomes, self.terminal,
            self.starts.astype(np.int64), intended, self.step_limit,
            actions_for_kernels(self.n_actions), (1,) if self.model == 'table' else ())


def action_type(n_actions: int) -> DTypeLike:
    """Return the type of arrays of actions: int8, or int16 where there are more than 127."""
    return np.int8 if n_actions <= np.iinfo(np.int8).max else np.int16


@kernel
def next_state(step: int, s: int, a: int, u: float,
               world: WorldArrays) -> tuple[float, int, bool, bool]:
    """
    Return reward, state, whether it is terminal, and whether the episode ends there.

    step: -1 before the first state of an episode. u: uniform in [0, 1).
    """
    if step < 0:
        return 0.0, first_state(u, world.starts), False, False
    if len(world.has_table) > 0:
        k = drawn_outcome(s, a, u, world.first, world.probability, world.actions)
        r, s2 = world.outcome_reward[k], world.outcome[k]
    else:
        b = taken_action(s, a, u, world.intended, world.slips)
        r, s2 = world.reward[s, b], world.successor[s, b]
    done = world.terminal[s2]
    return r, s2, done, done or step + 1 == world.step_limit


@kernel
def drawn_outcome(s: int, a: int, u: float, first: NDArray[np.int64],
                  probability: NDArray[np.float64], actions: Actions) -> int:
    """Return which outcome k of a `Table` action a has in state s. u: uniform in [0, 1)."""
    pair = count_actions(actions) * s + a
    k, last = first[pair], first[pair + 1] - 1
    sum_so_far = probability[k]
    while k < last and u >= sum_so_far:  # rounded, the sum may stay below 1
        k += 1
        sum_so_far += probability[k]
    return k


@kernel
def taken_action(s: int, a: int, u: float, intended: float, slips: NDArray[np.bool_]) -> int:
    """
    Return the action that really happens in a grid when a is meant in s: (2.22), (3.4).

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
