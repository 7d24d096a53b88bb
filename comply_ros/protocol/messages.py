# SPDX-License-Identifier: Apache-2.0
"""What is said between world, mentor and learner: tuples with the fields of the messages."""

from array import array
from math import isfinite
from typing import NamedTuple

from comply_ros.world.grid import Grid, NO_ACTION

ANYONE = 0  # number of no learner in particular
NO_RUN = 0  # number of no run; runs have numbers from 1 upwards
LONGEST_NAME = 255  # characters of the name of a world, as of a file
REPORTS = 1000  # reports of episodes and iterations that are kept for who comes late


class WorldDescription(NamedTuple):
    """
    All that another node needs to rebuild the world; `rows` top row first.

    replaces: the run that this one follows after a reset.
    """

    run: int
    began: float
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
    replaces: int = NO_RUN


class StateReward(NamedTuple):
    """The question: where the learner is now, and what the last action earned."""

    run: int
    episode: int
    step: int
    state: int
    reward: float
    terminated: bool
    truncated: bool
    learner: int = ANYONE


class Recommendation(NamedTuple):
    """What the mentor would do in that state; action -1 is no advice."""

    run: int
    episode: int
    step: int
    state: int
    action: int


class Action(NamedTuple):
    """The answer, and the advice it had; action -1 at an episode's end (the next may begin)."""

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


class Trust(NamedTuple):
    """Confidence in every state."""

    run: int
    width: int
    height: int
    confidence: array  # of type code f: a list would be looked at element by element


class Policy(NamedTuple):
    """Action of every state."""

    run: int
    width: int
    height: int
    action: array  # of type code b


class Values(NamedTuple):
    """Value of every state."""

    run: int
    width: int
    height: int
    value: array  # of type code d


class LearnerDescription(NamedTuple):
    """Who learns, and how; `settings` is JSON, `digest` is empty where it begins."""

    run: int
    learner: int
    turns: int
    method: str
    settings: str
    seed: int
    remembers_advice: bool
    digest: str


# What is said on each topic.
TOPIC_TYPES = {'world': WorldDescription, 'state': StateReward, 'recommendation': Recommendation,
          'action': Action, 'episode': Episode, 'progress': Progress, 'trust': Trust,
          'policy': Policy, 'values': Values, 'mentor_policy': Policy,
          'method': LearnerDescription}


class AnsweredObservation(NamedTuple):
    """A question that a learner has answered, and the advice that it had; for its journal."""

    episode: int
    step: int
    state: int
    reward: float
    terminated: bool
    truncated: bool
    advice: int


class Rejected(NamedTuple):
    """What could not be right, and was neither answered nor learned from."""

    kind: str
    reason: str


class Ignored(NamedTuple):
    """What came late or twice, as it may in any network, and changed nothing."""

    kind: str
    reason: str


class Inactive(NamedTuple):
    """This node is one too many: it says and learns nothing any more."""

    reason: str


class Notice(NamedTuple):
    """Something that a person at the terminal wants to know."""

    text: str


def follows(msg, before):
    """Tell whether a `WorldDescription` is the world of `before` (or None) after a reset."""
    return (before is not None and msg.replaces == before.run != NO_RUN
            and msg.sha256 == before.sha256)


def step_id(msg):
    """(episode, step) of a message of the loop: later messages have greater turns."""
    return msg.episode, msg.step


def describe(grid, name, run, began=0.0):
    """`WorldDescription` of a grid; began: seconds since 1970."""
    return WorldDescription(
        run=run, began=began, name=name, width=grid.width, height=grid.height, rows=grid.rows,
        starts=grid.starts, step_reward=grid.step_reward, obstacle_reward=grid.obstacle_reward,
        goal_reward=grid.goal_reward, intended=grid.intended, step_limit=grid.step_limit,
        slips_bump=grid.slips_bump, sha256=grid.sha256)


def grid_from_description(msg):
    """
    `Grid` of a `WorldDescription`.

    Raises
    ------
    ValueError: if it breaks a rule of the map, or is not what its hash says.

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
