# SPDX-License-Identifier: Apache-2.0
"""The world that a check plays for a mentor or a learner, and what they answer."""

from __future__ import annotations

from collections import Counter
from typing import Any

from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.messages import NO_RUN, StateReward, WorldDescription
from comply_ros.protocol.rule_report import Channel
from comply_ros.protocol.world import WorldMachine
from comply_ros.world.mdp import Source, World
from comply_ros.world.planning import optimal_policy


class EmulatedWorld:
    """
    Publishes a world and its observations, and finds the answers to them.

    Parameters
    ----------
    source: the world; it needs a model.
    channel: to the node that answers.
    answer: the type of its answers: `Recommendation` or `Action`.
    seed: of the world, and of `rng`.

    Attributes
    ----------
    world: the arrays of the world.
    best: `best[s]`: the best action.
    machine: what moves it.
    rng: for the actions of a check.

    """

    def __init__(self, source: Source, channel: Channel, answer: type[Any], seed: int) -> None:
        self.world, self.rng = World(source), random_streams(seed)[1]
        self.best = optimal_policy(self.world)
        self._channel, self._answers = channel, channel.received[answer.__name__]
        self._before = len(self._answers)  # of earlier checks
        self._published: Counter[tuple[int, int, int]] = Counter()
        self._excess_allowed: set[int] = set()
        self.machine = WorldMachine(source, 'check', self.new_run(), seed)

    @property
    def observation(self) -> StateReward:
        """The observation that is open."""
        return self.machine.observation

    def new_run(self) -> int:
        """Return a number that no run of this channel had before."""
        self._channel.last_run = other_number(self._channel.last_run)
        return self._channel.last_run

    def start_run(self, replaces: bool = True) -> WorldDescription:
        """
        Start a run from its first observation; return its description, which is not published.

        replaces: whether it says that it replaces the run that the node follows.
        """
        self.machine.reset(self.new_run(), 0)
        self.machine.description = self.machine.description._replace(
            replaces=self._channel.followed if replaces else NO_RUN)
        return self.machine.description

    def describe(self) -> None:
        """Start a run that replaces the one before, and publish its description."""
        self._channel.send(self.start_run())
        self._channel.followed = self.machine.description.run

    def describe_other_protocol(self) -> StateReward:
        """Publish the description of a run of another version; return its first observation."""
        mine = self.machine.description
        run = self.new_run()
        self._channel.send(mine._replace(protocol=mine.protocol + 90, run=run, replaces=mine.run))
        return self.observation._replace(run=run)

    def publish(self, observation: StateReward) -> None:
        """Publish an observation."""
        self._published[observation[:3]] += 1
        self._channel.send(observation)

    def allow_answer(self, observation: StateReward) -> None:
        """Count one more answer to an observation as right."""
        self._published[observation[:3]] += 1

    def allow_excess(self) -> None:
        """Count any number of answers in this run as right: its messages are doubled."""
        self._excess_allowed.add(self.observation.run)

    def answers(self, observation: StateReward) -> list[Any]:
        """Return the answers to an observation so far."""
        return [each for each in self._all_answers() if each[:3] == observation[:3]]

    def wait(self, observation: StateReward, seconds: float, count: int = 1) -> bool:
        """Wait for so many answers to an observation; return whether they came."""
        return self._channel.wait(lambda: len(self.answers(observation)) >= count, seconds)

    def published_before(self, observation: StateReward) -> tuple[int, int, int] | None:
        """Return run, episode and step of the observation of the run before this one, or None."""
        return max((key for key in self._published
                    if key[0] == observation.run and key < observation[:3]), default=None)

    def strange_answers(self) -> list[Any]:
        """Return the answers to observations that were not published."""
        return [each for each in self._all_answers() if each[:3] not in self._published]

    def excess_answers(self) -> list[Any]:
        """Return the answers to observations that were published less often than answered."""
        answers = self._all_answers()
        counts = Counter(each[:3] for each in answers)
        return [each for each in answers if each.run not in self._excess_allowed
                and counts[each[:3]] > self._published[each[:3]] > 0]

    def _all_answers(self) -> list[Any]:
        return [each.message for each in self._answers[self._before:]]


def other_number(number: int) -> int:
    """Return another number of a run or a learner."""
    return number % (2 ** 32 - 2) + 1
