# SPDX-License-Identifier: Apache-2.0
"""A check of a mentor: this side plays the world and the learner."""

from __future__ import annotations

import numpy as np

from comply_ros.protocol.messages import Action, Recommendation, StateReward
from comply_ros.protocol.played_world import PlayedWorld
from comply_ros.protocol.rule_report import Channel, PATIENCE, QUIET, RuleReport, Verdict
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import Source

RULES = {
    'P3': 'recommendations belong to an observation', 'P5': 'other protocols are rejected',
    'P9': 'a reset of the world is followed',
    'M1': 'each new observation is answered', 'M2': 'a repeated one is answered again',
    'M3': 'the action is one that the state has', 'M4': 'nothing where the episode has ended',
    'M6': 'the whole policy is published'}
STEPS = 60  # observations that are published in a run
LEARNER = 33


class MentorCheck:
    """
    Publishes the observations of a run to a mentor, repeats some, resets, and publishes one more.

    Parameters
    ----------
    source: the world of the check; it needs a model.
    channel: to the mentor.
    seed: of the world and of the actions.

    """

    def __init__(self, source: Source, channel: Channel, seed: int = 0) -> None:
        self._channel = channel
        self._played = PlayedWorld(source, channel, Recommendation, seed)
        self.report = RuleReport(RULES)

    def run(self) -> tuple[Verdict, ...]:
        """Check the mentor; return a verdict on each rule."""
        self._played.describe()
        for number in range(STEPS):
            if not self._check_answer(repeats=number % 5 == 0):
                break
            self._move()
        self._check_policy()
        self._check_reset()
        self._check_protocol()
        if self._channel.received['Recommendation']:
            strange = self._played.strange_answers()
            self.report.check('P3', not strange, 'recommendations with run, episode and step of '
                              'an observation', f'{len(strange)} of another one', *strange)
        return self.report.verdicts()

    def _check_answer(self, repeats: bool) -> bool:
        """Publish the open observation and check the answer; return whether there was one."""
        played, check = self._played, self.report.check
        observation, world = played.observation, played.world
        played.publish(observation)
        if observation.terminated:
            played.wait(observation, QUIET)
            answers = played.answers(observation)
            check('M4', not answers, 'no recommendation where the episode has ended by '
                  'terminated', f'{len(answers)} of them', observation, *answers)
            return True
        if not check('M1', played.wait(observation, PATIENCE), 'a recommendation for each new '
                     'observation that is not terminated', f'none within {PATIENCE:g} s',
                     observation):
            return False
        answer = played.answers(observation)[0]
        check('P3', answer.state == observation.state, 'a recommendation with the state of its '
              f'observation, {observation.state}', f'state {answer.state}', observation, answer)
        check('M3', answer.action == NO_ACTION or 0 <= answer.action < world.n_actions
              and world.available[observation.state, answer.action],
              'an action that the state has, or NO_ADVICE',
              f'action {answer.action} in state {observation.state}', observation, answer)
        if repeats:
            self._repeat(observation, answer)
        return True

    def _repeat(self, observation: StateReward, answer: Recommendation) -> None:
        count = len(self._played.answers(observation))
        self._played.publish(observation)
        again = self._played.wait(observation, PATIENCE, count + 1)
        self.report.check('M2', again, 'a recommendation again, when an observation is repeated',
                          f'none within {PATIENCE:g} s', observation, answer)

    def _move(self) -> None:
        """Take any action, or one on the best way, so that episodes end."""
        played = self._played
        run, episode, step, s, _, terminated, truncated, _ = played.observation
        action = NO_ACTION
        if not (terminated or truncated):
            action = int(played.best[s]) if played.rng.random() < 0.7 else int(
                played.rng.choice(np.flatnonzero(played.world.available[s])))
        msg = Action(run, episode, step, action, False, 0.0, LEARNER)
        self._channel.send(msg)
        played.machine.on_action(msg)

    def _check_policy(self) -> None:
        policies = [each.message for each in self._channel.received['Policy']
                    if each.message.run == self._played.observation.run]
        kept = bool(policies) and len(policies[-1].action) == self._played.world.n_states
        if policies or self._channel.received['Recommendation']:
            self.report.check('M6', kept, 'the advice in all states on mentor_policy',
                              f'{len(policies)} messages of this run', *policies)

    def _check_reset(self) -> None:
        self._played.reset()
        observation = self._played.observation
        self._played.publish(observation)
        followed = self._played.wait(observation, PATIENCE)
        self.report.check('P9', followed, 'an answer in a run that replaces the one before',
                          f'none within {PATIENCE:g} s', observation)

    def _check_protocol(self) -> None:
        observation = self._played.describe_other_protocol()
        self._played.publish(observation)
        answered = self._played.wait(observation, 5 * QUIET)
        self.report.check('P5', not answered, 'no answer in a world of another protocol',
                          'a recommendation', observation, *self._played.answers(observation))
