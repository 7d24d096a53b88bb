# SPDX-License-Identifier: Apache-2.0
"""What is said between world, mentor and learner: tuples with the fields of the messages."""

from math import isfinite
from typing import NamedTuple

from comply_ros.core.grid import Grid, NO_ACTION, OBSTACLE


class WorldDescription(NamedTuple):
    """All that another node needs to rebuild the world; `rows` top row first."""

    run: int
    name: str
    width: int
    height: int
    rows: tuple
    starts: tuple
    step_reward: float
    obstacle_reward: float
    goal_reward: float
    intended: float
    step_limit: int
    slips_bump: bool
    sha256: str


class StateReward(NamedTuple):
    """The question: where the learner is now, and what the last action earned."""

    run: int
    episode: int
    step: int
    state: int
    reward: float
    terminated: bool
    truncated: bool


class Recommendation(NamedTuple):
    """What the mentor would do in that state; action -1 is no advice."""

    run: int
    episode: int
    step: int
    state: int
    action: int


class Action(NamedTuple):
    """The answer: what the learner does; -1 at the end of an episode (the next may begin)."""

    run: int
    episode: int
    step: int
    action: int
    followed: bool
    confidence: float


class Episode(NamedTuple):
    """How an episode went."""

    run: int
    episode: int
    steps: int
    total_reward: float
    terminated: bool
    truncated: bool


class Progress(NamedTuple):
    """How an iteration went; `confidence` is nan where no decision had advice."""

    run: int
    iteration: int
    iterations: int
    episodes: int
    steps: int
    mean_return: float
    confidence: float
    temperature: float
    finished: bool


class Refused(NamedTuple):
    """What could not be right, and was neither answered nor learned from."""

    kind: str
    reason: str


class Notice(NamedTuple):
    """Something that a person at the terminal wants to know."""

    text: str


def turn(said):
    """(episode, step) of a message of the loop: later messages have greater turns."""
    return said.episode, said.step


def describe(grid, name, run):
    """`WorldDescription` of a grid."""
    return WorldDescription(
        run=run, name=name, width=grid.width, height=grid.height, rows=grid.rows,
        starts=grid.starts, step_reward=grid.step_reward, obstacle_reward=grid.obstacle_reward,
        goal_reward=grid.goal_reward, intended=grid.intended, step_limit=grid.step_limit,
        slips_bump=grid.slips_bump, sha256=grid.sha256)


def grid_of(said):
    """
    `Grid` of a `WorldDescription`.

    Raises
    ------
    ValueError: if it breaks a rule of the map, or is not what its hash says.

    """
    grid = Grid(tuple(said.rows), tuple(said.starts), said.step_reward, said.obstacle_reward,
                said.goal_reward, said.intended, said.step_limit, said.slips_bump)
    if (grid.width, grid.height) != (said.width, said.height):
        raise ValueError(f'width and height must be those of the rows, {grid.width} x '
                         f'{grid.height}, got {said.width} x {said.height}')
    if grid.sha256 != said.sha256:
        raise ValueError(f'sha256 must be that of the world, {grid.sha256[:8]}..., '
                         f'got {said.sha256[:8]!r}')
    return grid


def problem_of_state(said, world):
    """`Refused` for a `StateReward` that cannot be right in this world, or None."""
    cells = world.grid.cells
    if not 0 <= said.state < len(cells):
        return Refused('state outside the grid',
                       f'a state must lie in [0, {len(cells) - 1}], got {said.state}')
    if not isfinite(said.reward):
        return Refused('reward not a number',
                       f'a reward must be a finite number, got {said.reward}')
    if cells[said.state] == OBSTACLE:
        return Refused('state in an obstacle', 'a state must not be an obstacle, '
                       f'got {said.state} at {world.grid.place(said.state)}')
    if said.terminated != bool(world.terminal[said.state]):
        return Refused('wrong end', 'terminated must be true at a goal and nowhere else, '
                       f'got {said.terminated} in state {said.state}')
    limit = world.grid.step_limit
    if said.step > limit or said.truncated != (said.step == limit and not said.terminated):
        return Refused('wrong step', f'an episode must be truncated at step {limit} and nowhere '
                       f'else, got {said.truncated} at step {said.step}')
    return None


def problem_of_advice(said, world):
    """`Refused` for a `Recommendation` that cannot be right in this world, or None."""
    states = len(world.terminal)
    if not 0 <= said.state < states:
        return Refused('advice outside the grid', 'a recommendation must be for a state in '
                       f'[0, {states - 1}], got {said.state}')
    takes = world.free[said.state]  # elsewhere advice is idle, whatever it is
    if takes and said.action != NO_ACTION and not (
            0 <= said.action < 4 and world.available[said.state, said.action]):
        return Refused('advice not available', 'a recommendation must be an action that the cell '
                       f'has, or {NO_ACTION}, got {said.action} in state {said.state}')
    return None


def problem_of_run(said, run, topic):
    """`Refused` for a message of another run."""
    return Refused('another run', f'{topic} must belong to run {run} of the world here, '
                   f'got run {said.run}')
