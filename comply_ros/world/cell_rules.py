# SPDX-License-Identifier: Apache-2.0
"""`CellRules`: what the cells of a map do to whoever enters or leaves them, and their checks."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.grid import (
    ACTION_NAMES,
    ARROWS,
    CellRows,
    check_number,
    check_rows,
    check_size,
    check_step_limit,
    default_step_limit,
    FREE,
    LARGEST_REWARD,
    MapError,
    OBSTACLE,
    STEPS,
)
from comply_ros.world.wind import check_chances, Wind

START = 'S'
ONE_WAY = ARROWS  # ONE_WAY[action]: a cell that is left by this move only
BUILT_IN = (FREE, OBSTACLE, START, *ONE_WAY)  # cells that a legend cannot change
TO_START = 'start'
DIAGONAL = {'down_left': (-1, -1), 'down_right': (1, -1), 'up_left': (-1, 1), 'up_right': (1, 1)}
STAY = 'stay'
OTHER, RIGHT_ANGLES = 'other', 'right_angles'


class Letter(NamedTuple):
    """
    What a letter of a map means.

    reward: of a step onto such a cell, None for the step reward.
    ends: whether that step ends the episode.
    to: the cell (x, y) to which it leads at once, 'start' for one of the starts, None for none.
    on_leaving: whether not the step onto the cell, but every action from it, has this reward and
        leads there.
    """

    reward: float | None = None
    ends: bool = False
    to: tuple[int, int] | str | None = None
    on_leaving: bool = False


@dataclass(frozen=True)
class CellRules(CellRows):
    """
    A rectangular map; (0, 0) is the lower left cell, and (x, y) is state `y * width + x`.

    Parameters
    ----------
    rows: the cells as text, top row first: `.` free, `#` obstacle, `S` start, `<>v^` left by this
        move only, and letters of the legend.
    starts: the states in which an episode can start, equally likely.
    legend: the meaning of the other letters.
    step_reward: of a step onto a cell without a reward of its own.
    obstacle_reward, edge_reward, wall_reward: of a step against an obstacle, the edge of the map,
        or a wall between two cells, which leaves the agent where it is.
    intended: probability that a move goes where it was meant to, where `slips` has no chances.
    slips: what a move can become: 'other' (any other action of the cell, equally likely),
        'right_angles' (the two moves to its sides), or the chance of each turn, in degrees
        counter-clockwise, or of 'stay'.
    slips_bump: whether a slip to another action can leave the agent where it is.
    moves: 4, or 8 with the diagonal ones. stay: whether standing still is an action.
    edges_bump: whether one bumps into the edges; else no move leads there.
    walls: walls between cells, (x, y, x2, y2) from corner to corner; (0, 0) is the lower left
        corner of the map.
    wind: None for none.
    step_limit: number of steps after which an episode is truncated; None for ten times the
        number of states, and at most 1,000,000.
    continuing: whether no cell needs to end an episode.
    cell_size: side of a cell in metres. origin: (x, y, yaw) of the lower left corner of the map,
        in metres and radians.

    Raises
    ------
    MapError: naming the rule that is broken.

    """

    starts: tuple[int, ...]
    legend: Mapping[str, Letter]
    step_reward: float
    obstacle_reward: float
    edge_reward: float
    wall_reward: float
    intended: float = 1.0
    slips: str | Mapping[int | str, float] = OTHER
    slips_bump: bool = True
    moves: int = 4
    stay: bool = False
    edges_bump: bool = False
    walls: tuple[tuple[int, int, int, int], ...] = ()
    wind: Wind | None = None
    step_limit: int | None = None
    continuing: bool = False
    cell_size: float = 1.0
    origin: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0))

    def __post_init__(self) -> None:
        _check_rows(self)
        _check_rewards(self)
        _check_moves(self)
        _check_slips(self)
        _check_legend(self)
        _check_starts(self)
        for wall in self.walls:
            _check_wall(wall, self.width, self.height)
        if self.wind is not None:
            self.wind.check(self.width, self.height)

    @property
    def limit(self) -> int:
        """The step limit, also where the map gives none."""
        if self.step_limit is not None:
            return self.step_limit
        return default_step_limit(self.width * self.height)

    def is_cell(self, letters: str | list[str]) -> NDArray[np.bool_]:
        """`found[s]`: whether the cell of state s is one of these characters."""
        codes = np.array([ord(letter) for letter in letters], dtype=np.uint32)
        return np.isin(np.frombuffer(self.cells.encode('utf-32-le'), dtype=np.uint32), codes)

    def steps(self) -> dict[str, tuple[int, int]]:
        """Return (dx, dy) of every action by its name."""
        steps = dict(zip(ACTION_NAMES, STEPS, strict=True))
        return {**steps, **(DIAGONAL if self.moves == 8 else {}),
                **({STAY: (0, 0)} if self.stay else {})}


def _check_rows(rules: CellRules) -> None:
    check_rows(rules.rows, {*BUILT_IN, *rules.legend},
               '. # G S < > v ^ or a letter of the legend')
    check_size(rules.rows)
    ends = [letter for letter, meaning in rules.legend.items() if meaning.ends]
    if not rules.continuing and not rules.is_cell(ends).any():
        raise MapError('a map needs at least one goal G, another cell that ends the episode, or '
                       'continuing: true, got none')


def _check_rewards(rules: CellRules) -> None:
    rewards = {name: getattr(rules, name) for name in (
        'step_reward', 'obstacle_reward', 'edge_reward', 'wall_reward')}
    rewards |= {f'the reward of {letter!r}': meaning.reward
                for letter, meaning in rules.legend.items() if meaning.reward is not None}
    for name, reward in rewards.items():
        check_number(name, reward)


def _check_moves(rules: CellRules) -> None:
    if rules.moves not in (4, 8):
        raise MapError(f'moves must be 4 or 8, got {rules.moves}')
    if not 0 < rules.intended <= 1:
        raise MapError(f'intended must lie in (0, 1], got {rules.intended}')
    check_step_limit(rules.limit)
    if not 0 < rules.cell_size <= LARGEST_REWARD:
        raise MapError(f'cell_size must lie in (0, {LARGEST_REWARD:.0f}] metres, '
                       f'got {rules.cell_size}')


def _check_slips(rules: CellRules) -> None:
    if isinstance(rules.slips, str):
        if rules.slips not in (OTHER, RIGHT_ANGLES):
            raise MapError(f'slips must be {OTHER}, {RIGHT_ANGLES} or a table of chances, '
                           f'got {rules.slips!r}')
        return
    angles = [angle for angle in range(-180, 181, 360 // rules.moves) if angle]
    for turn in rules.slips:
        if turn != STAY and turn not in angles:
            raise MapError(f'a slip must turn by {", ".join(map(str, angles))} degrees, or '
                           f'{STAY}, got {turn!r}')
    if {180, -180} <= set(rules.slips):
        raise MapError('a slip of 180 degrees must be given once, got 180 and -180')
    check_chances('slips', rules.slips)
    if rules.intended != 1.0:
        raise MapError('intended must be left out where slips has chances: it is what they '
                       f'leave of 1, got {rules.intended}')


def _check_legend(rules: CellRules) -> None:
    for letter, meaning in rules.legend.items():
        if len(letter) != 1 or letter in BUILT_IN or not letter.isprintable() or letter == ' ':
            raise MapError(f'a letter of the legend must be one character other than '
                           f'{" ".join(BUILT_IN)}, got {letter!r}')
        if meaning.ends and meaning.to is not None:
            raise MapError(f'a letter either ends the episode or leads to a cell, got {letter!r} '
                           'with both')
        if meaning.on_leaving and meaning.to is None:
            raise MapError(f'a letter that acts on leaving must lead to a cell, got {letter!r} '
                           'without')
        if isinstance(meaning.to, tuple):
            _check_target(rules, letter, *meaning.to)


def _check_target(rules: CellRules, letter: str, x: int, y: int) -> None:
    if not (0 <= x < rules.width and 0 <= y < rules.height):
        raise MapError(f'{letter!r} must lead to a cell in the grid of {rules.width} x '
                       f'{rules.height} cells, got ({x}, {y})')
    if not can_stay(rules, rules.rows[rules.height - 1 - y][x]):
        raise MapError(f'{letter!r} must lead to a cell where one can stay, but ({x}, {y}) is '
                       f'{rules.rows[rules.height - 1 - y][x]!r}')


def can_stay(rules: CellRules, cell: str) -> bool:
    """Whether an agent can be in such a cell: no obstacle, and nothing leads away at once."""
    meaning = rules.legend.get(cell, Letter())
    return cell != OBSTACLE and (meaning.to is None or meaning.on_leaving)


def _check_starts(rules: CellRules) -> None:
    if not rules.starts:
        raise MapError('a map needs at least one start, got none')
    cells = rules.cells
    fit = {cell for cell in set(cells) if can_stay(rules, cell)
           and not rules.legend.get(cell, Letter()).ends}
    for s in rules.starts:
        if not 0 <= s < len(cells):
            raise MapError(f'a start must lie in the grid of {len(cells)} cells, got state {s}')
        if cells[s] not in fit:
            raise MapError('a start must be a cell where an episode can begin, but '
                           f'({s % rules.width}, {s // rules.width}) is {cells[s]!r}')


def _check_wall(wall: tuple[int, int, int, int], width: int, height: int) -> None:
    x, y, x2, y2 = wall
    if (x == x2) == (y == y2):
        raise MapError('a wall must go along a row or a column, from one corner to another, got '
                       f'({x}, {y}) to ({x2}, {y2})')
    if not (0 <= min(x, x2) <= max(x, x2) <= width and 0 <= min(y, y2) <= max(y, y2) <= height):
        raise MapError(f'a wall must lie in the grid of {width} x {height} cells, got '
                       f'({x}, {y}) to ({x2}, {y2})')
