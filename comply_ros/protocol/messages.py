# SPDX-License-Identifier: Apache-2.0
"""
The messages between world, mentor and learner, as tuples with the fields of `comply_msgs`.

The messages on the topics have a header before these fields, which the nodes add and drop.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import Any, NamedTuple

from comply_ros.world.grid import NO_ACTION

ANYONE = 0  # the number of any learner
NO_RUN = 0  # the number of no run; runs have numbers from 1 upwards
PROTOCOL = 3  # version of all messages; a world of another one is rejected
LONGEST_NAME = 255  # characters of the name of a world, as of a file
INITIAL_LEARNING = 'initial_learning'  # in the settings of a `LearnerDescription`: its digest
NANOSECONDS = 10 ** 9  # in a second
REPORTS = 1000  # reports of episodes and iterations that late subscribers receive

StepId = tuple[int, int]  # (episode, step): later messages of a run have greater ones


class GridModel(NamedTuple):
    """A world as a `Grid`; rows: top row first. Empty in the description of any other."""

    rows: tuple[str, ...] = ()
    step_reward: float = 0.0
    obstacle_reward: float = 0.0
    goal_reward: float = 0.0
    intended: float = 0.0
    slips_bump: bool = False


class TableModel(NamedTuple):
    """
    A world as a `Table`, whose arrays these are; empty in the description of any other.

    first, successor: type code I. probability, reward: type code d.
    terminal: type code I: the states in which an episode ends, ascending.
    """

    first: array[int] = array('I')
    successor: array[int] = array('I')
    probability: array[float] = array('d')
    reward: array[float] = array('d')
    terminal: array[int] = array('I')


class WorldDescription(NamedTuple):
    """
    What other nodes need to know of the world.

    protocol: `PROTOCOL`. replaces: the run that this one follows after a reset.
    began: start of the run, in nanoseconds since 1970.
    model: what is known beside states and actions: one of `MODELS`, by its index.
    available: of a world without a model, a value for each action of each state; empty for all.
    positions: of a table, x and y of each state in metres; type code d. cells: a character each.
    sha256: that of the world; empty if it is not to be checked.
    """

    protocol: int
    run: int
    replaces: int
    began: int
    name: str
    states: int
    actions: tuple[str, ...]
    starts: tuple[int, ...]
    step_limit: int
    model: int
    grid: GridModel
    table: TableModel
    available: tuple[bool, ...]
    positions: array[float]
    cells: tuple[str, ...]
    sha256: str


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
    """The action of the mentor in a state, -1 for no advice; mentor: empty for the only one."""

    run: int
    episode: int
    step: int
    state: int
    action: int
    mentor: str = ''


class Action(NamedTuple):
    """
    The action of the learner, and the advice it had; -1 at the end of an episode.

    mentor: whose advice it considered, by its place in `LearnerDescription.mentors`.
    all_advice: with several mentors, that of each; type code h.
    """

    run: int
    episode: int
    step: int
    action: int
    followed: bool
    confidence: float
    learner: int = ANYONE
    advice: int = NO_ACTION
    observation_count: int = 0
    mentor: int = 0
    all_advice: tuple[int, ...] = ()


class Episode(NamedTuple):
    """Steps and return of an episode."""

    run: int
    episode: int
    steps: int
    total_reward: float
    terminated: bool
    truncated: bool


class Progress(NamedTuple):
    """
    The result of an iteration; `confidence` is nan where no decision had advice.

    With several mentors, one for all of them, then one with the name of each that has one.
    """

    run: int
    iteration: int
    iterations: int
    episodes: int
    steps: int
    mean_return: float
    confidence: float
    temperature: float
    finished: bool
    mentor: str = ''


class Trust(NamedTuple):
    """Confidence in a mentor in every state; with several, one for each."""

    run: int
    confidence: array[float]  # type code f: rclpy checks a list element by element
    mentor: str = ''


class Policy(NamedTuple):
    """Action of every state."""

    run: int
    action: array[int]  # type code h


class Values(NamedTuple):
    """Value of every state."""

    run: int
    value: array[float]  # type code d


class LearnerDescription(NamedTuple):
    """
    The learner and its settings (JSON); `digest` is empty at the start of a training.

    mentors: their names; the only one may have none.
    """

    run: int
    learner: int
    observation_count: int
    method: str
    settings: str
    seed: int
    remembers_advice: bool
    digest: str
    mentors: tuple[str, ...] = ('',)


# The message of each topic.
TOPIC_TYPES: dict[str, type[Any]] = {
    'world': WorldDescription, 'state': StateReward, 'recommendation': Recommendation,
    'action': Action, 'episode': Episode, 'progress': Progress, 'trust': Trust, 'policy': Policy,
    'values': Values, 'mentor_policy': Policy, 'method': LearnerDescription}

# Fields that are tuples themselves.
INNER_TUPLES: dict[str, type[Any]] = {'grid': GridModel, 'table': TableModel}


class AnsweredObservation(NamedTuple):
    """An observation that a learner has answered, and the advice that it had, for its journal."""

    episode: int
    step: int
    state: int
    reward: float
    terminated: bool
    truncated: bool
    advice: int


class ReceivedAdvice(NamedTuple):
    """A recommendation that a learner has received, for its journal."""

    run: int
    episode: int
    step: int
    state: int
    action: int


class ReceivedAction(NamedTuple):
    """An action that a world or a mentor has received, for its journal."""

    run: int
    episode: int
    step: int
    action: int
    followed: bool
    confidence: float
    learner: int
    advice: int
    observation_count: int


class OtherAdvice(NamedTuple):
    """What mentor m, not the first, advised in the observation that is answered next."""

    m: int
    action: int


class ReceivedOtherAdvice(NamedTuple):
    """A recommendation of mentor m, not the first, that a learner has received."""

    m: int
    run: int
    episode: int
    step: int
    state: int
    action: int


# All that the journal of a learner holds.
LEARNER_JOURNAL = (AnsweredObservation, ReceivedAdvice, OtherAdvice, ReceivedOtherAdvice)


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


def tuple_maker(tuple_type: type[Any]) -> Callable[[Any], Any]:
    """
    Return a function from an object with the same fields to a tuple, and to the tuples in it.

    A time, with the fields `sec` and `nanosec`, becomes its nanoseconds.
    """
    inner = {name: tuple_maker(kind)
             for name, kind in INNER_TUPLES.items() if name in tuple_type._fields}

    def value_of(field: Any, name: str) -> Any:
        if name in inner:
            return inner[name](field)
        return field.sec * NANOSECONDS + field.nanosec if hasattr(field, 'nanosec') else field
    return lambda message: tuple_type(*[
        value_of(getattr(message, name), name) for name in tuple_type._fields])


def step_id(msg: Any) -> StepId:
    """(episode, step) of a message of the loop."""
    return msg.episode, msg.step
