# SPDX-License-Identifier: Apache-2.0
"""The taxi of Dietterich (2000): fetch a passenger at one stop, and deliver them at another."""

from collections.abc import Iterator

import numpy as np

from comply_ros.world.cell_rules import BUILT_IN, CellRules, Letter
from comply_ros.world.cell_rules_table import table_of
from comply_ros.world.grid import ACTION_NAMES, default_step_limit, FREE, MapError, OBSTACLE
from comply_ros.world.transition_table import Table

ACTIONS = (*ACTION_NAMES, 'pick_up', 'drop_off')
MOST_STATES = 200_000

Outcome = tuple[int, float]  # successor, reward


def taxi_table(rows: tuple[str, ...], walls: tuple[tuple[int, int, int, int], ...],
               step_reward: float, deliver_reward: float, wrong_reward: float,
               step_limit: int | None) -> Table:
    """
    Return the MDP of a taxi on a map.

    With n stops, state `((y * width + x) * (n + 1) + p) * n + d` has the taxi in cell (x, y), the
    passenger at stop p (n: in the taxi) and the destination d. An episode starts with the taxi in
    any cell and the passenger at any stop other than the destination.

    Parameters
    ----------
    rows: the cells, top row first: `.` free, `#` obstacle, any other character a stop. Stops are
        numbered from the top row to the bottom row, from left to right.
    walls: as in `CellRules`.
    step_reward: of a step without another reward. deliver_reward: of a delivery, which ends the
        episode. wrong_reward: of picking up or dropping off where that cannot be done.
    step_limit: number of steps after which an episode is truncated; None for ten times the
        number of states.

    Raises
    ------
    MapError: naming the rule that is broken.

    """
    stops = _stops(rows)
    move = _driving(rows, walls)
    count = len(stops)
    states = len(move) * (count + 1) * count
    if states > MOST_STATES:
        raise MapError(f'a taxi may have at most {MOST_STATES} states, got {states}')
    starts = tuple((cell * (count + 1) + p) * count + d for cell in _any_cell(rows)
                   for p in range(count) for d in range(count) if p != d)
    terminal = np.zeros(states, dtype=bool)
    terminal[[(stops[d] * (count + 1) + d) * count + d for d in range(count)]] = True
    outcomes = [each for s in range(states) for each in _outcomes(
        s, stops, move, terminal, (step_reward, deliver_reward, wrong_reward))]
    first = np.concatenate(([0], np.cumsum([each is not None for each in outcomes])))
    made = [each for each in outcomes if each is not None]
    s = np.arange(states) // ((count + 1) * count)
    width, cells = len(rows[0]), ''.join(reversed(rows))
    return Table(
        actions=ACTIONS, first=first.astype(np.int64),
        successor=np.array([each[0] for each in made], dtype=np.int32),
        probability=np.ones(len(made)), reward=np.array([each[1] for each in made], dtype=float),
        terminal=terminal, starts=starts,
        step_limit=default_step_limit(states) if step_limit is None else step_limit,
        positions=np.stack((s % width, s // width), axis=-1) + 0.5,
        cells=tuple(cells[cell] for cell in s))


def _stops(rows: tuple[str, ...]) -> list[int]:
    """Return the cells of the stops."""
    stops, letters, height = [], '', len(rows)
    for number, row in enumerate(rows):
        for x, cell in enumerate(row):
            if cell not in (FREE, OBSTACLE):
                stops.append((height - 1 - number) * len(row) + x)
                letters += cell
    wrong = next((letter for letter in letters if letter in BUILT_IN), None)
    if wrong is not None:
        raise MapError(f'a stop must be one character other than {" ".join(BUILT_IN)}, '
                       f'got {wrong!r}')
    if len(stops) < 2:
        raise MapError(f'a taxi needs at least two stops, got {len(stops)}')
    twice = next((letter for letter in letters if letters.count(letter) > 1), None)
    if twice is not None:
        raise MapError(f'a stop must be there once, got {twice!r} again')
    return stops


def _driving(rows: tuple[str, ...], walls: tuple[tuple[int, int, int, int], ...]) -> np.ndarray:
    """`next[cell, a]`: where a move leads; the edges are bumped into. -1 in an obstacle."""
    letters = {letter: Letter() for letter in ''.join(rows) if letter not in (FREE, OBSTACLE)}
    table = table_of(CellRules(
        rows=rows, starts=_any_cell(rows), legend=letters, step_reward=0.0, obstacle_reward=0.0,
        edge_reward=0.0, wall_reward=0.0, edges_bump=True, walls=walls, continuing=True))
    move = np.full(len(table.first) - 1, -1)
    move[np.diff(table.first) > 0] = table.successor
    return move.reshape(-1, len(ACTION_NAMES))


def _any_cell(rows: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(s for s, cell in enumerate(''.join(reversed(rows))) if cell != OBSTACLE)


def _outcomes(s: int, stops: list[int], move: np.ndarray, terminal: np.ndarray,
              rewards: tuple[float, float, float]) -> Iterator[Outcome | None]:
    """Yield successor and reward of every action in state s; None where there is no action."""
    count = len(stops)
    (rest, d), (step, deliver, wrong) = divmod(s, count), rewards
    cell, p = divmod(rest, count + 1)
    if terminal[s] or move[cell, 0] < 0:
        yield from [None] * len(ACTIONS)
        return

    def state(cell: int, p: int) -> int:
        return (int(cell) * (count + 1) + p) * count + d
    for target in move[cell]:
        yield state(target, p), step
    waits_here = p < count and stops[p] == cell
    yield (state(cell, count), step) if waits_here else (s, wrong)
    if p < count or cell not in stops:
        yield s, wrong
    else:
        here = stops.index(cell)
        yield state(cell, here), deliver if here == d else step
