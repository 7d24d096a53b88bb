# SPDX-License-Identifier: Apache-2.0
"""The `Table` of a map: what its rules make of every action in every cell."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.cell_rules import (
    CellRules,
    Letter,
    ONE_WAY,
    OTHER,
    RIGHT_ANGLES,
    STAY,
    TO_START,
)
from comply_ros.world.cell_walk import BUMPED_EDGE, BUMPED_NOT, CellWalk, States
from comply_ros.world.grid import ACTION_NAMES, MapError, OBSTACLE
from comply_ros.world.reachability import can_reach
from comply_ros.world.transition_table import Table

STAND_STILL = ''  # a slip that leads nowhere; it is no action
SOME_START = -1  # a successor that is still to become one of the starts
CHUNK = 1 << 16  # states that are computed at once
MOST_OUTCOMES = 20_000_000

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


class Outcomes(NamedTuple):
    """
    The outcomes of all actions in some states.

    count: `count[i, a]` of outcomes. successor, probability, reward: one after the other.
    """

    count: NDArray[np.int64]
    successor: States
    probability: Floats
    reward: Floats


def table_of(rules: CellRules) -> Table:
    """
    Return the MDP of a map, with one state for each cell and no action in obstacles and ends.

    Outcomes of an action with the same successor and reward are one outcome.

    Raises
    ------
    MapError: if a goal cannot be reached from every start, or there are too many outcomes.

    """
    parts, total = [], 0
    moves = _CellMoves(rules)
    for s in _chunks(rules.width * rules.height):
        parts.append(_with_starts(moves.outcomes(s), rules.starts))
        total += len(parts[-1].successor)
        if total > MOST_OUTCOMES:
            raise MapError(f'a map may have at most {MOST_OUTCOMES} outcomes of its actions in '
                           'all states, got more')
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    first = np.concatenate(([0], np.cumsum(columns[0].ravel())))
    table = Table(actions=tuple(rules.steps()), first=first,
                  successor=columns[1].astype(np.int32), probability=columns[2],
                  reward=columns[3], terminal=moves.ends, starts=rules.starts,
                  step_limit=rules.limit, positions=_positions(rules),
                  cells=tuple(rules.cells))
    _check_ways(rules, table)
    return table


def _chunks(count: int) -> Iterator[States]:
    for begin in range(0, count, CHUNK):
        yield np.arange(begin, min(begin + CHUNK, count))


def _with_starts(outcomes: Outcomes, starts: tuple[int, ...]) -> Outcomes:
    """Return the outcomes with `SOME_START` as one outcome for each start, equally likely."""
    count, successor, probability, reward = outcomes
    back = successor == SOME_START
    if not back.any():
        return outcomes
    if back.sum() * len(starts) > MOST_OUTCOMES:
        raise MapError(f'a map may have at most {MOST_OUTCOMES} outcomes of its actions in all '
                       f'states, got more: {len(starts)} starts behind each step back to them')
    times = np.where(back, len(starts), 1)
    row = np.repeat(np.arange(count.size), count.ravel())
    grown = np.bincount(row, times, count.size).astype(np.int64).reshape(count.shape)
    probability = np.repeat(probability / times, times)
    reward, successor = np.repeat(reward, times), np.repeat(successor, times)
    successor[successor == SOME_START] = np.tile(starts, int(back.sum()))
    return Outcomes(grown, successor, probability, reward)


def _positions(rules: CellRules) -> Floats:
    """`p[s]` = (x, y) of the center of the cell of state s, in metres."""
    s = np.arange(rules.width * rules.height)
    along = (np.stack((s % rules.width, s // rules.width), axis=-1) + 0.5) * rules.cell_size
    x, y, yaw = rules.origin
    turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    return along @ turn + (x, y)


def _check_ways(rules: CellRules, table: Table) -> None:
    """Fail unless a goal, or where there is none another end, can be reached from all starts."""
    is_goal = rules.is_cell('G') & table.terminal
    wanted, name = (is_goal, 'the goal') if is_goal.any() else (table.terminal, 'an end')
    if not wanted.any():
        return
    found = can_reach(table.first, table.successor, len(table.actions), wanted)
    lost = [s for s in rules.starts if not found[s]]
    if lost:
        raise MapError(f'{name} must be reachable from every start, but no way leads there from '
                       f'({lost[0] % rules.width}, {lost[0] // rules.width})')


class _CellMoves:
    """
    Where every step leads from some cells, and what it earns.

    Attributes
    ----------
    ends: `ends[s]`: whether the episode ends in state s.

    """

    def __init__(self, rules: CellRules) -> None:
        self._rules = rules
        self._walk = CellWalk(rules)
        self._steps = rules.steps()
        self._one_way = {arrow: rules.is_cell(arrow) for arrow in ONE_WAY}
        self._bump_reward = np.array(
            [rules.step_reward, rules.edge_reward, rules.obstacle_reward, rules.wall_reward])
        self._read_legend()

    def _read_legend(self) -> None:
        """Set the arrays of what the letters mean."""
        rules = self._rules
        count = rules.width * rules.height
        self.ends = np.zeros(count, dtype=bool)
        self._entry_reward = np.full(count, rules.step_reward)
        self._entry_target = np.arange(count)  # where one is after a step onto the cell
        self._exits: list[tuple[Bools, int, float]] = []
        for letter, meaning in rules.legend.items():
            here = rules.is_cell(letter)
            self.ends |= here & meaning.ends
            reward = rules.step_reward if meaning.reward is None else meaning.reward
            if meaning.on_leaving:
                self._exits.append((here, self._target(meaning), reward))
                continue
            self._entry_reward[here] = reward
            if meaning.to is not None:
                self._entry_target[here] = self._target(meaning)
        leads_away = self._entry_target != np.arange(count)
        # Whether one can act in a cell.
        self._acts = ~(rules.is_cell(OBSTACLE) | self.ends | leads_away)

    def _target(self, meaning: Letter) -> int:
        if meaning.to == TO_START:
            return SOME_START
        assert isinstance(meaning.to, tuple)
        return meaning.to[1] * self._rules.width + meaning.to[0]

    def outcomes(self, s: States) -> Outcomes:
        """Return the outcomes of all actions in some states, equal ones as one."""
        steps = self._steps_of_slips()
        exists = np.stack([self._exists(s, name, step) for name, step in steps.items()], axis=-1)
        variants = self._rules.wind.variants() if self._rules.wind else [(1.0, 0.0, 0)]
        landings = [self._landing(s, step, exists[:, b], factor, change)
                    for b, step in enumerate(steps.values()) for _, factor, change in variants]
        successor = np.stack([each[0] for each in landings], axis=-1)  # [i, b * variants + v]
        reward = np.stack([each[1] for each in landings], axis=-1)
        moves = self._slip_chances(s, exists, successor[:, ::len(variants)])  # [i, a, b]
        chance = np.array([each[0] for each in variants])
        probability = (moves[..., None] * chance).reshape(*moves.shape[:2], -1)
        probability *= (exists[:, :len(self._steps)] & self._acts[s, None])[..., None]
        for here, target, earned in self._exits:
            successor[here[s]], reward[here[s]] = target, earned
        _merge(successor, reward, probability)
        i, a, k = np.nonzero(probability)
        count = np.bincount(i * len(self._steps) + a, minlength=len(s) * len(self._steps))
        return Outcomes(count.reshape(len(s), -1), successor[i, k], probability[i, a, k],
                        reward[i, k])

    def _steps_of_slips(self) -> dict[str, tuple[int, int]]:
        """Return (dx, dy) of every action, and of what a slip can become besides them."""
        slips = self._rules.slips
        can_stand = not isinstance(slips, str) and STAY in slips
        still = {STAND_STILL: (0, 0)} if can_stand else {}
        return {**self._steps, **still}

    def _exists(self, s: States, name: str, step: tuple[int, int]) -> Bools:
        """Whether a move exists in the cells: one-way cells, edges."""
        rules = self._rules
        found = np.ones(len(s), dtype=bool)
        for arrow, only in zip(ONE_WAY, ACTION_NAMES, strict=True):
            if step != (0, 0) and name != only:
                found &= ~self._one_way[arrow][s]
        if not rules.edges_bump:
            x, y = s % rules.width + step[0], s // rules.width + step[1]
            found &= (0 <= x) & (x < rules.width) & (0 <= y) & (y < rules.height)
        return found

    def _landing(self, s: States, step: tuple[int, int], exists: Bools, factor: float,
                 change: int) -> tuple[States, Floats]:
        """Return where a step with a variant of the wind leads, and what it earns."""
        dx, dy = self._wind(s, factor, change)
        target, bump = self._walk.walk(s, np.where(exists, step[0], 0) + dx,
                                       np.where(exists, step[1], 0) + dy)
        bump = np.where((bump == BUMPED_NOT) & ~exists, BUMPED_EDGE, bump)
        stuck = (target == s) & (bump != BUMPED_NOT)
        reward = np.where(stuck, self._bump_reward[bump], self._entry_reward[target])
        return np.where(stuck, s, self._entry_target[target]), reward

    def _wind(self, s: States, factor: float, change: int) -> tuple[States, States]:
        """Return the cells (dx, dy) by which the wind carries from each cell."""
        calm, wind = np.zeros(len(s), dtype=np.int64), self._rules.wind
        if wind is None or factor == 0.0:
            return calm, calm
        if wind.columns is not None:
            strength = np.array(wind.columns)[s % self._rules.width]
        else:
            strength = np.array(wind.rows)[::-1][s // self._rules.width]
        strength = np.sign(strength) * (np.abs(strength) + change)
        return (calm, strength) if wind.columns is not None else (strength, calm)

    def _slip_chances(self, s: States, exists: Bools, successor: States) -> Floats:
        """`p[i, a, b]`: probability that action a becomes step b; one of `_steps_of_slips`."""
        rules, names = self._rules, [*self._steps_of_slips()]
        actions = len(self._steps)
        if rules.slips == OTHER:
            return self._other_chances(s, exists[:, :actions], successor[:, :actions])
        side = (1.0 - rules.intended) / 2
        turns = {90: side, -90: side} if rules.slips == RIGHT_ANGLES else rules.slips
        assert not isinstance(turns, str)
        chances = np.zeros((actions, len(names)))
        for a, step in enumerate(self._steps.values()):
            if step == (0, 0):
                chances[a, a] = 1.0
                continue
            for turn, chance in turns.items():
                turned = STAND_STILL if turn == STAY else self._turned(step, int(turn))
                chances[a, names.index(turned)] += chance
            chances[a, a] = 1.0 - sum(turns.values())
        return np.broadcast_to(chances, (len(s), *chances.shape))

    def _turned(self, step: tuple[int, int], degrees: int) -> str:
        """Name of a move turned counter-clockwise."""
        angle = np.arctan2(step[1], step[0]) + np.deg2rad(degrees)
        dx, dy = round(np.cos(angle) * 1.1), round(np.sin(angle) * 1.1)
        return next(name for name, each in self._steps.items() if each == (dx, dy))

    def _other_chances(self, s: States, exists: Bools, successor: States) -> Floats:
        """`p[i, a, b]` where a slip becomes any other action of the cell, equally likely."""
        rules, actions = self._rules, len(self._steps)
        slips = exists & (rules.slips_bump | (successor != s[:, None]))
        others = slips[:, None, :] & ~np.eye(actions, dtype=bool)  # [i, a, b]
        count = others.sum(axis=-1, keepdims=True)
        chances = others * ((1.0 - rules.intended) / np.maximum(count, 1))
        a = np.arange(actions)
        chances[:, a, a] = np.where(count[..., 0] > 0, rules.intended, 1.0)
        return chances


def _merge(successor: States, reward: Floats, probability: Floats) -> None:
    """Change probability: add up equal outcomes `[i, a, k]` in the first of them."""
    for k in range(1, successor.shape[1]):
        left = np.ones(len(successor), dtype=bool)
        for j in range(k):
            same = np.flatnonzero(left & (successor[:, j] == successor[:, k])
                                  & (reward[:, j] == reward[:, k]))
            probability[same, :, j] += probability[same, :, k]
            probability[same, :, k] = 0.0
            left[same] = False
