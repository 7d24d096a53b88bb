# SPDX-License-Identifier: Apache-2.0
"""The learner that a check plays for a world: it chooses actions at random."""

from __future__ import annotations

from typing import Any

import numpy as np

from comply_ros.protocol.messages import Action, StateReward, step_id
from comply_ros.protocol.rule_report import Channel, RuleReport
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World

REMEMBERED = 4  # actions that were accepted
RECENT = 10  # observations, of which the newest is the open one


class EmulatedLearner:
    """
    Sends actions to a world, and finds what follows from them.

    Parameters
    ----------
    world: as it is described.
    channel: to it.
    report: takes the verdicts.
    number: of the learner.
    patience: seconds that an answer may take.

    Attributes
    ----------
    number: of the learner.
    accepted: the last actions that the world should have accepted.

    """

    def __init__(self, world: World, channel: Channel, report: RuleReport, number: int,
                 patience: float) -> None:
        self.world, self._channel, self._check = world, channel, report.check
        self.number, self._patience = number, patience
        self.accepted: list[Action] = []

    @property
    def observation(self) -> StateReward:
        """The newest observation of the run from which the last one came."""
        last = [each.message for each in self._channel.received['StateReward'][-RECENT:]]
        return max((msg for msg in last if msg.run == last[-1].run), key=step_id)

    def choose(self, observation: StateReward, rng: np.random.Generator) -> int:
        """Return any action that the state has, or none at the end of an episode."""
        if observation.terminated or observation.truncated:
            return NO_ACTION
        return int(rng.choice(np.flatnonzero(self.world.available[observation.state])))

    def send(self, observation: StateReward, action: int, **changes: Any) -> Action:
        """Send an action for an observation, with some fields changed; return it."""
        msg = Action(*observation[:3], action, False, 0.0, self.number)._replace(**changes)
        self._channel.send(msg)
        return msg

    def new(self, observation: StateReward) -> StateReward | None:
        """Return the first observation of the run after this one, if it was received."""
        found = None
        for each in reversed(self._channel.received['StateReward']):
            if each.message.run != observation.run or step_id(each.message) <= step_id(
                    observation):
                break
            found = each.message
        return found

    def act(self, observation: StateReward, action: int, rule: str = 'W5') -> StateReward | None:
        """Send an action; return the observation that follows, None if none does."""
        msg = self.send(observation, action)
        came = self._channel.wait(lambda: self.new(observation), self._patience)
        self._check(rule, came, 'the next observation after an action for the open one',
                    f'none within {self._patience:g} s', observation, msg)
        self.accepted = [*self.accepted, msg][-REMEMBERED:]
        return self.new(observation)
