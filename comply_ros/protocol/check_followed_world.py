# SPDX-License-Identifier: Apache-2.0
"""Which world a mentor or a learner follows: the part of their checks that is the same."""

from __future__ import annotations

from collections.abc import Callable

from comply_ros.protocol.emulated_world import EmulatedWorld
from comply_ros.protocol.messages import StateReward
from comply_ros.protocol.rule_report import Channel, PATIENCE, QUIET, RuleReport

RULES = {
    'P5': 'other protocols are rejected', 'P7': 'an observation may come before its world',
    'P8': 'the first world is followed', 'P9': 'a reset of the world is followed',
    'P10': 'another world is followed where the first is silent'}
AT_ONCE = 1.0  # seconds; another world is followed after one or two
ASK_AGAIN = 0.5  # seconds between two observations of another world


class FollowingCheck:
    """
    Describes worlds to a node, and finds out which of them it follows.

    Parameters
    ----------
    played: the world of the check.
    channel: to the node.
    report: takes the verdicts.
    advise: called with an observation that was published, to send what its answer needs.
    patience: seconds that an answer may take.

    """

    def __init__(self, played: EmulatedWorld, channel: Channel, report: RuleReport,
                 advise: Callable[[StateReward], None], patience: float = PATIENCE) -> None:
        self._played, self._channel, self._check = played, channel, report.check
        self._advise, self._patience = advise, patience

    def reset(self) -> bool:
        """Start a run that replaces the one before; return whether it is followed at once."""
        self._played.describe()
        observation = self._publish()
        return self._check(
            'P9', self._played.wait(observation, AT_ONCE),
            'an answer in a run that replaces the one before',
            f'none within {AT_ONCE:g} s', observation)

    def other_protocol(self) -> None:
        """Describe a world of another protocol: it must not be answered."""
        observation = self._played.describe_other_protocol()
        self._check_silent('P5', observation, 'no answer in a world of another protocol')

    def early(self) -> None:
        """Publish an observation, then its world: it must be answered then."""
        description = self._played.start_run()
        observation = self._publish()
        self._channel.wait(lambda: False, QUIET)  # so that no other order is possible
        self._channel.send(description)
        self._channel.followed = description.run
        self._check('P7', self._played.wait(observation, self._patience),
                    'an answer to an observation that came before the description of its world',
                    f'none within {self._patience:g} s', observation, description)

    def second_world(self) -> None:
        """Describe another world while the first one publishes, then while it is silent."""
        first = self._channel.followed
        self._publish()  # the first world is alive
        second = self._played.start_run(replaces=False)
        self._channel.send(second)
        self._check_silent('P8', self._played.observation,
                           'no answer in a second world while the first one publishes')
        self._channel.followed = second.run
        observation = self._played.observation
        for _ in range(int(self._patience / ASK_AGAIN)):
            self._channel.send(second)
            self._publish()
            if self._played.wait(observation, ASK_AGAIN):
                break
        if not self._check('P10', self._played.answers(observation), 'an answer in another world, '
                           'while the one that was followed is silent',
                           f'none within {self._patience:g} s', second, observation):
            self._channel.followed = first

    def _publish(self) -> StateReward:
        observation = self._played.observation
        self._played.publish(observation)
        self._advise(observation)
        return observation

    def _check_silent(self, rule: str, observation: StateReward, expected: str) -> None:
        self._played.publish(observation)
        self._advise(observation)
        answered = self._played.wait(observation, 2 * QUIET)
        self._check(rule, not answered, expected, 'an answer', observation,
                    *self._played.answers(observation))
