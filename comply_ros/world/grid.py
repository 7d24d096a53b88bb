# SPDX-License-Identifier: Apache-2.0
"""`Grid`: the cells, rewards and starts of a grid world, and the checks of its rules."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, InitVar
from functools import cached_property
import hashlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.reachability import can_reach_goal

FREE, OBSTACLE, GOAL = CELLS = '.#G'
LEFT, RIGHT, DOWN, UP = range(4)
NO_ACTION = -1  # of a mentor: no advice; of a learner: the episode is over
ACTION_NAMES = 'left', 'right', 'down', 'up'
ARROWS = '<>v^'  # ARROWS[action]
STEPS = ((-1, 0), (1, 0), (0, -1), (0, 1))  # STEPS[action]: (dx, dy), x to the right, y up

LARGEST_SIDE = 4096
LARGEST_REWARD = 1e6
MOST_STEPS = 1_000_000  # of an episode


class MapError(ValueError):
    """A map that breaks a rule; the message names the rule and the value."""


@dataclass(frozen=True)
class CellRows:
    """What the cells of every rectangular map share; the rows are text, top row first."""

    rows: tuple[str, ...]

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.rows[0])

    @property
    def height(self) -> int:
        """Number of rows."""
        return len(self.rows)

    @property
    def cells(self) -> str:
        """All cells in the order of the states: `cells[s]` is the character of state s."""
        return ''.join(reversed(self.rows))


@dataclass(frozen=True)
class Grid(CellRows):
    """
    A rectangular grid world; a state is `y * width + x`, with (0, 0) at the lower left.

    Parameters
    ----------
    rows: the cells as text, top row first: `.` free, `#` obstacle, `G` goal (terminal).
    starts: the states in which an episode can start, equally likely.
    step_reward: of a step onto a free cell (below 0).
    obstacle_reward: of a step against an obstacle, which leaves the agent where it is (below 0).
    goal_reward: of a step onto the goal.
    intended: probability that a move goes where it was meant to; otherwise it becomes one of
        the cell's other actions, equally likely.
    step_limit: number of steps after which an episode is truncated.
    slips_bump: whether a slip can run into an obstacle; if not, it becomes one of those other
        actions that lead to another cell.
    expected: the value that `sha256` must have, None for any. It is checked before reachability,
        which can take seconds.

    Raises
    ------
    MapError: naming the rule that is broken.

    """

    starts: tuple[int, ...]
    step_reward: float
    obstacle_reward: float
    goal_reward: float
    intended: float
    step_limit: int
    slips_bump: bool = True
    expected: InitVar[str | None] = None

    def __post_init__(self, expected: str | None) -> None:
        check_rows(self.rows, CELLS, '. # G')
        check_size(self.rows)
        _check_goal(self.rows)
        _check_numbers(self)
        _check_starts(self)
        if expected not in (None, self.sha256):
            raise MapError(f'sha256 must be that of the world, {self.sha256[:8]}..., '
                           f'got {expected[:8]!r}')
        unreachable = np.flatnonzero(~self.can_reach_goal[np.array(self.starts, dtype=np.int64)])
        if len(unreachable):
            x, y = self.place(self.starts[unreachable[0]])
            raise MapError('the goal must be reachable from every start, '
                           f'but no way leads there from ({x}, {y})')

    @cached_property
    def sha256(self) -> str:
        """
        SHA-256 (hex) of all fields: equal hashes mean equal worlds.

        It is that of these bytes, all numbers little-endian: the text `comply_ros grid 1` and a
        line feed; width, height, number of starts and step limit (int64 each); `step_reward`,
        `obstacle_reward`, `goal_reward` and `intended` (float64 each); `slips_bump` (a byte, 0 or
        1); the cells, a character each, from state 0 on; and `starts` (int64 each). A reward of
        -0.0 counts as 0.0.
        """
        sizes = self.width, self.height, len(self.starts), self.step_limit
        numbers = self.step_reward, self.obstacle_reward, self.goal_reward, self.intended
        return hashlib.sha256(b''.join((
            b'comply_ros grid 1\n', np.array(sizes, dtype='<i8').tobytes(),
            (np.array(numbers, dtype='<f8') + 0.0).tobytes(), bytes((self.slips_bump,)),
            self.cells.encode(), np.array(self.starts, dtype='<i8').tobytes()))).hexdigest()

    @cached_property
    def can_reach_goal(self) -> NDArray[np.bool_]:
        """`can_reach_goal[s]`: whether a goal can be reached from state s; true at goals."""
        cells = np.frombuffer(self.cells.encode(), dtype='S1').reshape(self.height, self.width)
        return can_reach_goal(cells == FREE.encode(), cells == GOAL.encode()).ravel()

    def place(self, s: Any) -> tuple[Any, Any]:
        """Return (x, y) of a state, or of an array of states."""
        return s % self.width, s // self.width


def check_rows(rows: Sequence[str], known: Collection[str] | None = None,
               rule: str = '') -> None:
    """
    Return if rows are a rectangle of known cells.

    known: the characters that a cell can be, None for any. rule: names them in the sentence.

    Raises
    ------
    MapError: if there are no rows, their lengths differ, or a cell is not known.

    """
    if not rows or not rows[0]:
        raise MapError('a map needs at least one row of cells, got none')
    for number, row in enumerate(rows, 1):
        if len(row) != len(rows[0]):
            raise MapError('all rows must have the same length: '
                           f'row {number} has {len(row)} cells, row 1 has {len(rows[0])}')
        if known is not None and not set(row) <= set(known):
            column, cell = next((x, cell) for x, cell in enumerate(row, 1) if cell not in known)
            raise MapError(f'a cell must be one of {rule}, got {cell!r} '
                           f'in row {number}, column {column}')


def check_size(rows: Sequence[str]) -> None:
    """Return if a map may be so large; raises MapError."""
    if max(len(rows), len(rows[0])) > LARGEST_SIDE:
        raise MapError(f'a map may have at most {LARGEST_SIDE} cells a side, '
                       f'got {len(rows[0])} x {len(rows)}')


def check_number(name: str, value: float) -> None:
    """Return if a reward, or another number of a map, is finite and not too large."""
    if not abs(value) <= LARGEST_REWARD:
        raise MapError(f'{name} must be a finite number of at most {LARGEST_REWARD:.0f}, '
                       f'got {value}')


def check_step_limit(step_limit: int) -> None:
    """Return if episodes can have this limit; raises MapError."""
    if not 1 <= step_limit <= MOST_STEPS:
        raise MapError(f'step_limit must lie in [1, {MOST_STEPS}], got {step_limit}')


def default_step_limit(states: int) -> int:
    """Step limit of a map that gives none: ten times its states, and at most 1,000,000."""
    return min(10 * states, MOST_STEPS)


def _check_goal(rows: tuple[str, ...]) -> None:
    if not any(GOAL in row for row in rows):
        raise MapError('a map needs at least one goal G, got none')


def _check_numbers(grid: Grid) -> None:
    for name in ('step_reward', 'obstacle_reward', 'goal_reward', 'intended'):
        check_number(name, getattr(grid, name))
    for name in ('step_reward', 'obstacle_reward'):
        if getattr(grid, name) >= 0:
            raise MapError(f'{name} must be below 0, or the best policy never arrives, '
                           f'got {getattr(grid, name)}')
    if not 0 < grid.intended <= 1:
        raise MapError(f'intended must lie in (0, 1], got {grid.intended}')
    check_step_limit(grid.step_limit)


def _check_starts(grid: Grid) -> None:
    if not grid.starts:
        raise MapError('a map needs at least one start, got none')
    cells = grid.cells
    if (min(grid.starts) >= 0 and max(grid.starts) < len(cells)
            and set(map(cells.__getitem__, grid.starts)) == {FREE}):
        return  # of a large map the loop below takes long
    for s in grid.starts:
        if not 0 <= s < len(cells):
            raise MapError(f'a start must lie in the grid of {len(cells)} cells, got state {s}')
        x, y = grid.place(s)
        if cells[s] != FREE:
            what = 'an obstacle' if cells[s] == OBSTACLE else 'the goal'
            raise MapError(f'a start must be a free cell, but ({x}, {y}) is {what}')
