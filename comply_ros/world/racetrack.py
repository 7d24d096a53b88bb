# SPDX-License-Identifier: Apache-2.0
"""The race track of Sutton and Barto (2018), exercise 5.12: a car with a velocity."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from comply_ros.world.cell_rules import START
from comply_ros.world.grid import default_step_limit, FREE, MapError, OBSTACLE
from comply_ros.world.transition_table import Table

FINISH = 'F'
TRACK_CELLS = (FREE, OBSTACLE, START, FINISH)
CHANGES = tuple((ax, ay) for ay in (-1, 0, 1) for ax in (-1, 0, 1))  # of the velocity (x, y)
LARGEST_SPEED = 20
MOST_STATES = 200_000

Velocity = tuple[int, int]


class _Track(NamedTuple):
    """The cells of a track, (x, y) to character, the number of each, and the largest speed."""

    cells: dict[tuple[int, int], str]
    number: dict[tuple[int, int], int]
    speeds: int  # from 0, so many

    def state(self, place: tuple[int, int], velocity: Velocity) -> int:
        return (self.number[place] * self.speeds + velocity[1]) * self.speeds + velocity[0]


def racetrack_table(rows: tuple[str, ...], step_reward: float = -1.0, noise: float = 0.1,
                    largest_speed: int = 4, step_limit: int | None = None) -> Table:
    """
    Return the MDP of a car on a race track.

    State `(c * n + vy) * n + vx` has the car in cell c of those that are no obstacle, numbered
    from the bottom row to the top row, with a velocity of vx cells to the right and vy cells up,
    each of n = largest_speed + 1 values from 0. Both are 0 on the starting line only. An action
    changes each by -1, 0 or 1. A car that leaves the track goes back to a start, with velocity 0.

    Parameters
    ----------
    rows: the cells, top row first: `.` track, `#` beside it, `S` starting line, `F` finish.
    step_reward: of every step.
    noise: probability that the velocity does not change, whatever the action.
    step_limit: number of steps after which an episode is truncated; None for ten times the
        number of states.

    Raises
    ------
    MapError: naming the rule that is broken.

    """
    track = _track(rows, noise, largest_speed)
    starts = tuple(track.state(place, (0, 0)) for place, cell in track.cells.items()
                   if cell == START)
    count, successor, probability = [], [], []
    for outcomes in _all_outcomes(track, starts, noise):
        count.append(len(outcomes))
        successor += outcomes.keys()
        probability += outcomes.values()
    terminal = np.repeat([cell == FINISH for cell in track.cells.values()], track.speeds ** 2)
    places = np.repeat(np.array(list(track.cells), dtype=float), track.speeds ** 2, axis=0)
    limit = default_step_limit(len(terminal)) if step_limit is None else step_limit
    return Table(
        actions=tuple(f'{ax:+d}{ay:+d}' for ax, ay in CHANGES),
        first=np.concatenate(([0], np.cumsum(count))).astype(np.int64),
        successor=np.array(successor, dtype=np.int32), probability=np.array(probability),
        reward=np.full(len(successor), step_reward), terminal=terminal, starts=starts,
        step_limit=limit, positions=places + 0.5,
        cells=tuple(cell for cell in track.cells.values() for _ in range(track.speeds ** 2)))


def _track(rows: tuple[str, ...], noise: float, largest_speed: int) -> _Track:
    if not 0 <= noise < 1:
        raise MapError(f'noise must lie in [0, 1), got {noise}')
    if not 1 <= largest_speed <= LARGEST_SPEED:
        raise MapError(f'largest_speed must lie in [1, {LARGEST_SPEED}], got {largest_speed}')
    cells = {(x, y): cell for y, row in enumerate(reversed(rows)) for x, cell in enumerate(row)}
    wrong = next((cell for cell in cells.values() if cell not in TRACK_CELLS), None)
    if wrong is not None:
        raise MapError(f'a cell of a track must be one of {" ".join(TRACK_CELLS)}, got {wrong!r}')
    for needed, name in ((START, 'start'), (FINISH, 'finish')):
        if needed not in cells.values():
            raise MapError(f'a track needs at least one {name} {needed}, got none')
    road = {place: cell for place, cell in cells.items() if cell != OBSTACLE}
    states = len(road) * (largest_speed + 1) ** 2
    if states > MOST_STATES:
        raise MapError(f'a track may have at most {MOST_STATES} states, got {states}')
    return _Track(road, {place: k for k, place in enumerate(road)}, largest_speed + 1)


def _landing(track: _Track, place: tuple[int, int], velocity: Velocity) -> int | None:
    """State to which a car drives from a cell, None where it leaves the track."""
    (x, y), (vx, vy) = place, velocity
    steps = max(vx, vy)
    for k in range(1, steps + 1):
        # The cell nearest to the straight line; halves are rounded away from the start.
        place = x + (2 * k * vx + steps) // (2 * steps), y + (2 * k * vy + steps) // (2 * steps)
        if track.cells.get(place) is None:
            return None
        if track.cells[place] == FINISH:
            break
    return track.state(place, velocity)


def _all_outcomes(track: _Track, starts: tuple[int, ...],
                  noise: float) -> Iterator[dict[int, float]]:
    """Yield the probability of every successor, for each state and each action in it."""
    velocities = [(vx, vy) for vy in range(track.speeds) for vx in range(track.speeds)]
    for place, cell in track.cells.items():
        ahead = {each: _landing(track, place, each) for each in velocities}
        for velocity in velocities:
            for change in CHANGES:
                yield {} if cell == FINISH else _outcomes(
                    ahead, starts, cell, velocity, change, noise)


def _outcomes(ahead: dict[Velocity, int | None], starts: tuple[int, ...], cell: str,
              velocity: Velocity, change: Velocity, noise: float) -> dict[int, float]:
    """Return the probability of every successor; none where the action does not exist."""
    changed = velocity[0] + change[0], velocity[1] + change[1]
    if changed not in ahead or (changed == (0, 0) and cell != START):
        return {}
    found: dict[int, float] = {}
    for driven, chance in ((changed, 1.0 - noise), (velocity, noise)):
        target = ahead[driven]
        for s in starts if target is None else (target,):
            share = chance / len(starts) if target is None else chance
            if share > 0:
                found[s] = found.get(s, 0.0) + share
    return found
