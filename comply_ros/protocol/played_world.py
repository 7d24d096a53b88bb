# SPDX-License-Identifier: Apache-2.0
"""The world that a check plays for a mentor or a learner, and what they answer."""

from __future__ import annotations

from collections import Counter
from typing import Any

from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.messages import StateReward
from comply_ros.protocol.rule_report import Channel
from comply_ros.world.mdp import Source, World
from comply_ros.world.planning import optimal_policy


class PlayedWorld:
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
        self.machine = GridWorld(source, 'check', int(self.rng.integers(1, 2 ** 32)), seed)
        self._channel, self._answers = channel, channel.received[answer.__name__]
        self._published: Counter[tuple[int, int, int]] = Counter()

    @property
    def observation(self) -> StateReward:
        """The observation that is open."""
        return self.machine.observation

    def describe(self) -> None:
        """Publish the description of the run."""
        self._channel.send(self.machine.description)

    def describe_other_protocol(self) -> StateReward:
        """Publish the description of a run of another version; return its first observation."""
        mine = self.machine.description
        run = other_number(mine.run)
        self._channel.send(mine._replace(protocol=mine.protocol + 90, run=run, replaces=mine.run))
        return self.observation._replace(run=run)

    def reset(self) -> None:
        """Start a run that replaces the one before, and publish its description."""
        self.machine.reset(other_number(self.machine.description.run), 0)
        self.describe()

    def publish(self, observation: StateReward) -> None:
        """Publish an observation."""
        self._published[observation[:3]] += 1
        self._channel.send(observation)

    def answers(self, observation: StateReward) -> list[Any]:
        """Return the answers to an observation so far."""
        return [each.message for each in self._answers if each.message[:3] == observation[:3]]

    def wait(self, observation: StateReward, seconds: float, count: int = 1) -> bool:
        """Wait for so many answers to an observation; return whether they came."""
        return self._channel.wait(lambda: len(self.answers(observation)) >= count, seconds)

    def published_before(self, observation: StateReward) -> tuple[int, int, int]:
        """Return the run, episode and step of the last observation before this one."""
        return max(key for key in self._published if key[1:] < observation[1:3])

    def strange_answers(self) -> list[Any]:
        """Return the answers to observations that were not published."""
        return [each.message for each in self._answers
                if each.message[:3] not in self._published]

    def excess_answers(self) -> list[Any]:
        """Return the answers to observations that were published less often than answered."""
        counts = Counter(each.message[:3] for each in self._answers)
        return [each.message for each in self._answers
                if counts[each.message[:3]] > self._published[each.message[:3]] > 0]


def other_number(number: int) -> int:
    """Return another number of a run or a learner."""
    return number % (2 ** 32 - 2) + 1
