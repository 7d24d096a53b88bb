# SPDX-License-Identifier: Apache-2.0
"""How a check disturbs a world: it waits, and sends late and wrong actions."""

from __future__ import annotations

from typing import Any

import numpy as np

from comply_ros.protocol.emulated_learner import EmulatedLearner
from comply_ros.protocol.emulated_world import other_number
from comply_ros.protocol.messages import ANYONE, StateReward
from comply_ros.protocol.observation_checks import ObservationChecks
from comply_ros.protocol.rule_report import Channel, QUIET, RuleReport
from comply_ros.world.grid import NO_ACTION

RULES = {
    'P6': 'late and repeated actions do not move', 'W11': 'an open observation is repeated',
    'W12': 'wrong actions are not accepted'}


class WorldDisturbances:
    """
    Disturbs a world, which must do nothing then, but repeat its observation.

    Parameters
    ----------
    learner: that the check plays.
    checks: of observations.
    channel: to the world.
    report: takes the verdicts.
    rng: for actions.
    patience: seconds that an answer may take.

    """

    def __init__(self, learner: EmulatedLearner, checks: ObservationChecks, channel: Channel,
                 report: RuleReport, rng: np.random.Generator, patience: float) -> None:
        self._learner, self._checks, self._channel = learner, checks, channel
        self._check, self._rng, self._patience = report.check, rng, patience

    def check_repeats(self) -> None:
        """Leave an observation open: it must be repeated, and nothing else must follow."""
        observation = self._learner.observation

        def repeats() -> list[StateReward]:
            return [each.message for each in self._channel.received['StateReward']
                    if each.message[:3] == observation[:3]]
        count = len(repeats())
        self._channel.wait(lambda: False, 4 * QUIET)
        self._channel.wait(lambda: len(repeats()) > count, self._patience)
        same = [each._replace(learner=ANYONE) == observation._replace(learner=ANYONE)
                for each in repeats()]
        self._check('W11', len(same) > count and all(same), 'the open observation again, '
                    f'with the same fields, within {self._patience:g} s',
                    f'{len(same) - count} more, {same.count(False)} with other fields',
                    *repeats())
        after = self._learner.new(observation)
        if after:
            self._checks.lose_track()
        self._check('W5', after is None, 'no new observation without an action', 'one',
                    observation, after)

    def send_late(self) -> None:
        """Send the last actions again, in another order: they must not move it."""
        for msg in self._learner.accepted:
            observation = self._learner.observation
            self._channel.send(msg)
            moved = self._channel.wait(lambda before=observation: self._learner.new(before), QUIET)
            if moved:
                self._checks.lose_track()
            self._check('P6', not moved, 'no move by an action that was accepted before',
                        'a move', observation, msg, self._learner.new(observation))

    def send_wrong(self) -> None:
        """Send actions that must not be accepted."""
        observation = self._learner.observation
        if observation.terminated or observation.truncated:
            return
        missing = np.flatnonzero(~self._learner.world.available[observation.state])
        right = self._learner.choose(observation, self._rng)
        wrong: list[tuple[int, dict[str, Any]]] = []
        if observation.learner != ANYONE:  # first of all: after a while the run is free
            wrong.append((right, {'learner': other_number(self._learner.number)}))
        wrong += [(right, {'run': other_number(observation.run)}), (NO_ACTION, {}),
                  (self._learner.world.n_actions, {}), (right, {'step': observation.step + 1})]
        wrong += [(int(missing[0]), {})] if len(missing) else []
        for action, changes in wrong:
            self.send_wrong_action(observation, action, **changes)

    def send_wrong_action(self, observation: StateReward, action: int, **changes: Any) -> None:
        """Send one, an action for an observation with some fields changed."""
        msg = self._learner.send(observation, action, **changes)
        moved = self._channel.wait(lambda: self._learner.new(observation), QUIET)
        if moved:
            self._checks.lose_track()
        self._check('W12', not moved, 'no move by an action of another run, of another '
                    'learner, for another observation, or that the state lacks',
                    f'a move by action {action} {changes or ""}', observation, msg,
                    self._learner.new(observation))
