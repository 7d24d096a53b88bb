# SPDX-License-Identifier: Apache-2.0
"""The messages between world, mentor and learner, as tuples with the fields of `comply_msgs`."""

from __future__ import annotations

from array import array
from math import isfinite
from typing import Any, NamedTuple

from comply_ros.world.grid import Grid, NO_ACTION

ANYONE = 0  # the number of any learner
NO_RUN = 0  # the number of no run; runs have numbers from 1 upwards
LONGEST_NAME = 255  # characters of the name of a world, as of a file
INITIAL_LEARNING = 'initial_learning'  # in the settings of a `LearnerDescription`: its digest
REPORTS = 1000  # reports of episodes and iterations that late subscribers receive

StepId = tuple[int, int]  # (episode, step): later messages of a run have greater ones


class WorldDescription(NamedTuple):
    """
    Everything that another node needs to rebuild the world.

    rows: top row first. replaces: the run that this one follows after a reset.
    """

    run: int
    began: float
    name: str
    width: int
    height: int
    rows: tuple[str, ...]
    starts: tuple[int, ...]
    step_reward: float
    obstacle_reward: float
    goal_reward: float
    intended: float
    step_limit: int
    slips_bump: bool
    sha256: str
    replaces: int = NO_RUN


class StateReward(NamedTuple):
    """An observation: the state of the learner, and the reward of its last action."""

    run: int
    episode: int
    step: int
    state: int
    reward: float
    terminated: bool
    truncated: bool
    learner: int = ANYONE


class Recommendation(NamedTuple):
    """The action of the mentor in a state, -1 for no advice."""

    run: int
    episode: int
    step: int
    state: int
    action: int


class Action(NamedTuple):
    """The action of the learner, and the advice it had; -1 at the end of an episode."""

    run: int
    episode: int
    step: int
    action: int
    followed: bool
    confidence: float
    learner: int = ANYONE
    advice: int = NO_ACTION
    turns: int = 0


class Episode(NamedTuple):
    """Steps and return of an episode."""

    run: int
    episode: int
    steps: int
    total_reward: float
    terminated: bool
    truncated: bool


class Progress(NamedTuple):
    """The result of an iteration; `confidence` is nan where no decision had advice."""

    run: int
    iteration: int
    iterations: int
    episodes: int
    steps: int
    mean_return: float
    confidence: float
    temperature: float
    finished: bool


class Trust(NamedTuple):
    """Confidence in every state."""

    run: int
    width: int
    height: int
    confidence: array[float]  # type code f: rclpy checks a list element by element


class Policy(NamedTuple):
    """Action of every state."""

    run: int
    width: int
    height: int
    action: array[int]  # type code b


class Values(NamedTuple):
    """Value of every state."""

    run: int
    width: int
    height: int
    value: array[float]  # type code d


class LearnerDescription(NamedTuple):
    """The learner and its settings (JSON); `digest` is empty at the start of a training."""

    run: int
    learner: int
    turns: int
    method: str
    settings: str
    seed: int
    remembers_advice: bool
    digest: str


# The message of each topic.
TOPIC_TYPES: dict[str, type[Any]] = {
    'world': WorldDescription, 'state': StateReward, 'recommendation': Recommendation,
    'action': Action, 'episode': Episode, 'progress': Progress, 'trust': Trust, 'policy': Policy,
    'values': Values, 'mentor_policy': Policy, 'method': LearnerDescription}


class AnsweredObservation(NamedTuple):
    """An observation that a learner has answered, and the advice that it had, for its journal."""

    episode: int
    step: int
    state: int
    reward: float
    terminated: bool
    truncated: bool
    advice: int


class Rejected(NamedTuple):
    """A message that cannot be right: nothing is answered or learned from it."""

    kind: str
    reason: str


class Ignored(NamedTuple):
    """A message that came late or twice, as in any network: it changes nothing."""

    kind: str
    reason: str


class Inactive(NamedTuple):
    """Another learner or world owns this run: this node publishes and learns nothing any more."""

    reason: str


class Notice(NamedTuple):
    """A line for the log."""

    text: str


Output = Any  # one of the tuples above: to be published or logged
Outputs = tuple[Output, ...]


def step_id(msg: Any) -> StepId:
    """(episode, step) of a message of the loop."""
    return msg.episode, msg.step


def is_reset_of(description: WorldDescription, before: WorldDescription | None) -> bool:
    """Tell whether a world is the world of `before` after a reset."""
    return (before is not None and description.replaces == before.run != NO_RUN
            and description.sha256 == before.sha256)


def describe_world(grid: Grid, name: str, run: int, began: float = 0.0) -> WorldDescription:
    """Return the description of a grid; began: seconds since 1970, for people to read."""
    return WorldDescription(
        run=run, began=began, name=name, width=grid.width, height=grid.height, rows=grid.rows,
        starts=grid.starts, step_reward=grid.step_reward, obstacle_reward=grid.obstacle_reward,
        goal_reward=grid.goal_reward, intended=grid.intended, step_limit=grid.step_limit,
        slips_bump=grid.slips_bump, sha256=grid.sha256)


def grid_from_description(msg: WorldDescription) -> Grid:
    """
    `Grid` of a `WorldDescription`.

    Raises
    ------
    ValueError: if it breaks a rule of the map, or does not have the hash that it gives.

    """
    grid = Grid(tuple(msg.rows), tuple(msg.starts), msg.step_reward, msg.obstacle_reward,
                msg.goal_reward, msg.intended, msg.step_limit, msg.slips_bump,
                expected=msg.sha256)
    if (grid.width, grid.height) != (msg.width, msg.height):
        raise ValueError(f'width and height must be those of the rows, {grid.width} x '
                         f'{grid.height}, got {msg.width} x {msg.height}')
    if len(msg.name) > LONGEST_NAME:
        raise ValueError(f'a name must have at most {LONGEST_NAME} characters, '
                         f'got {len(msg.name)}')
    if not isfinite(msg.began):
        raise ValueError(f'began must be a finite number, got {msg.began}')
    return grid
