# SPDX-License-Identifier: Apache-2.0
"""A check of a mentor: this side plays the world and the learner."""

from __future__ import annotations

import numpy as np

from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.messages import Action, Recommendation, StateReward
from comply_ros.protocol.rule_report import Channel, RuleReport, Verdict
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import Source, World
from comply_ros.world.planning import optimal_policy

RULES = {
    'P3': 'recommendations belong to an observation', 'P5': 'other protocols are rejected',
    'P9': 'a reset of the world is followed',
    'M1': 'each new observation is answered', 'M2': 'a repeated one is answered again',
    'M3': 'the action is one that the state has', 'M4': 'nothing where the episode has ended',
    'M6': 'the whole policy is published'}
PATIENCE = 10.0  # seconds that a recommendation may take
QUIET = 0.3  # seconds without a message that count as silence
STEPS = 60  # observations that the mentor is asked in a run
LEARNER = 33


class MentorCheck:
    """
    Asks a mentor in one run, repeats, resets, and asks again.

    Parameters
    ----------
    source: the world of the check; it needs a model.
    channel: to the mentor.
    seed: of the world and of the actions.

    """

    def __init__(self, source: Source, channel: Channel, seed: int = 0) -> None:
        self._channel, self._world = channel, World(source)
        self._rng, self._best = random_streams(seed)[1], optimal_policy(self._world)
        run = int(self._rng.integers(1, 2 ** 32))
        self._machine = GridWorld(source, 'check', run, seed)
        self._asked: dict[tuple[int, int, int], StateReward] = {}
        self.report = RuleReport(RULES)

    def run(self) -> tuple[Verdict, ...]:
        """Check the mentor; return a verdict on each rule."""
        self._start()
        for number in range(STEPS):
            if not self._ask(repeats=number % 5 == 0):
                break
            self._move()
        self._check_policy()
        self._check_reset()
        self._check_protocol()
        self._check_origins()
        return self.report.verdicts()

    def _start(self) -> None:
        self._channel.send(self._machine.description)

    def _answers(self, observation: StateReward) -> list[Recommendation]:
        return [each.message for each in self._channel.heard['Recommendation']
                if each.message[:3] == observation[:3]]

    def _publish(self, observation: StateReward) -> None:
        self._asked[observation[:3]] = observation
        self._channel.send(observation)

    def _ask(self, repeats: bool) -> bool:
        """Publish the open observation and check the answer; return whether there was one."""
        observation, check = self._machine.observation, self.report.check
        self._publish(observation)
        if observation.terminated:
            self._channel.wait(lambda: self._answers(observation), QUIET)
            answers = self._answers(observation)
            check('M4', not answers, 'no recommendation where the episode has ended by '
                  'terminated', f'{len(answers)} of them', observation, *answers)
            return True
        answered = self._channel.wait(lambda: self._answers(observation), PATIENCE)
        if not check('M1', answered, 'a recommendation for each new observation that is not '
                     'terminated', f'none within {PATIENCE:g} s', observation):
            return False
        answer = self._answers(observation)[0]
        check('P3', answer.state == observation.state, 'a recommendation with the state of its '
              f'observation, {observation.state}', f'state {answer.state}', observation, answer)
        available = self._world.available[observation.state]
        check('M3', answer.action == NO_ACTION or 0 <= answer.action < self._world.n_actions
              and available[answer.action], 'an action that the state has, or NO_ADVICE',
              f'action {answer.action} in state {observation.state}', observation, answer)
        if repeats:
            self._repeat(observation, answer)
        return True

    def _repeat(self, observation: StateReward, answer: Recommendation) -> None:
        count = len(self._answers(observation))
        self._publish(observation)
        again = self._channel.wait(lambda: len(self._answers(observation)) > count, PATIENCE)
        self.report.check('M2', again, 'a recommendation again, when an observation is repeated',
                          f'none within {PATIENCE:g} s', observation, answer)

    def _move(self) -> None:
        """Take any action, or one on the best way, so that episodes end."""
        run, episode, step, s, _, terminated, truncated, _ = self._machine.observation
        action = NO_ACTION
        if not (terminated or truncated):
            action = int(self._best[s]) if self._rng.random() < 0.7 else int(
                self._rng.choice(np.flatnonzero(self._world.available[s])))
        msg = Action(run, episode, step, action, False, 0.0, LEARNER)
        self._channel.send(msg)
        self._machine.on_action(msg)

    def _check_policy(self) -> None:
        policies = [each.message for each in self._channel.heard['Policy']
                    if each.message.run == self._machine.description.run]
        kept = bool(policies) and len(policies[-1].action) == self._world.n_states
        if policies or self._channel.heard['Recommendation']:
            self.report.check('M6', kept, 'the advice in all states on mentor_policy',
                              f'{len(policies)} messages of this run', *policies)

    def _check_reset(self) -> None:
        """Start a new run that replaces the old one: the mentor follows it at once."""
        before = self._machine.description.run
        outputs = self._machine.reset(before % (2 ** 32 - 2) + 1, 0)
        for each in outputs:
            if hasattr(each, 'protocol'):
                self._channel.send(each)
        observation = self._machine.observation
        self._publish(observation)
        followed = self._channel.wait(lambda: self._answers(observation), PATIENCE)
        self.report.check('P9', followed, 'an answer in a run that replaces the one before',
                          f'none within {PATIENCE:g} s', self._machine.description, observation)

    def _check_protocol(self) -> None:
        """Describe a world of another version: nothing of it may be answered."""
        other = self._machine.description.run % (2 ** 32 - 2) + 1
        self._channel.send(self._machine.description._replace(
            protocol=self._machine.description.protocol + 90, run=other,
            replaces=self._machine.description.run))
        observation = self._machine.observation._replace(run=other)
        self._publish(observation)
        answered = self._channel.wait(lambda: self._answers(observation), 5 * QUIET)
        self.report.check('P5', not answered, 'no answer in a world of another protocol',
                          'a recommendation', observation, *self._answers(observation))

    def _check_origins(self) -> None:
        """Check that every recommendation was for an observation that was published."""
        strange = [each.message for each in self._channel.heard['Recommendation']
                   if each.message[:3] not in self._asked]
        if self._channel.heard['Recommendation']:
            self.report.check('P3', not strange, 'recommendations with run, episode and step of '
                              'an observation', f'{len(strange)} of another one', *strange)
