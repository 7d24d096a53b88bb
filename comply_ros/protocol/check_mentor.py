# SPDX-License-Identifier: Apache-2.0
"""A check of a mentor: this side plays the world and the learner."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from comply_ros.protocol.check_followed_world import FollowingCheck
from comply_ros.protocol.check_followed_world import RULES as FOLLOWING
from comply_ros.protocol.check_plan_shortening import Plan
from comply_ros.protocol.emulated_world import EmulatedWorld
from comply_ros.protocol.messages import Action, Recommendation, StateReward
from comply_ros.protocol.rule_report import Channel, PATIENCE, QUIET, RuleReport, Verdict
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import Source

RULES = {
    'P3': 'recommendations belong to an observation', **FOLLOWING,
    'M1': 'each new observation is answered', 'M2': 'a repeated one is answered again',
    'M3': 'the action is one that the state has', 'M4': 'nothing where the episode has ended',
    'M5': 'a single mentor has no name', 'M6': 'the whole policy is published',
    'M7': 'a budget begins anew after a reset', 'M8': 'it answers only when it is asked'}
# Sixty observations, of which every fifth is repeated, then worlds to follow or not.
PLAN: Plan = (*('repeat', *('answer',) * 4) * 12, 'policy', 'reset', 'budget', 'early',
              'second world', 'other protocol')
LEARNER = 33


class MentorCheck:
    """
    Publishes the observations of a run to a mentor, repeats some, resets, and changes the world.

    Parameters
    ----------
    source: the world of the check; it needs a model.
    channel: to the mentor.
    seed: of the world and of the actions.
    plan: what to do.
    patience: seconds that an answer may take.

    """

    def __init__(self, source: Source, channel: Channel, seed: int = 0, plan: Plan = PLAN,
                 patience: float = PATIENCE) -> None:
        self._channel, self._plan, self._patience = channel, plan, patience
        self._played = EmulatedWorld(source, channel, Recommendation, seed)
        self.report = RuleReport(RULES, channel)
        following = FollowingCheck(self._played, channel, self.report, lambda _: None, patience)
        self._first: Recommendation | None = None  # answer of the first run
        self._went_without = False  # whether some answer of that run was no advice
        self._items: dict[str, Callable[[], object]] = {
            'answer': self._check_answer, 'repeat': self._check_repeated,
            'policy': self._check_policy, 'reset': following.reset, 'budget': self._check_budget,
            'early': following.early, 'second world': following.second_world,
            'other protocol': following.other_protocol}

    def run(self) -> tuple[Verdict, ...]:
        """Check the mentor; return a verdict on each rule."""
        self._played.describe()
        self.report.follow(self._plan, lambda item: self._items[item]())
        strange = self._played.strange_answers()
        if self._first:
            self.report.check('P3', not strange, 'recommendations with run, episode and step of '
                              'an observation', f'{len(strange)} of another one', *strange)
            self._channel.wait(lambda: False, QUIET)
            excess = self._played.excess_answers()
            self.report.check('M8', not excess, 'at most one recommendation for each time that an '
                              'observation is published', f'{len(excess)} for observations that '
                              'were published less often', *excess)
        return self.report.verdicts()

    def _check_answer(self) -> bool:
        """Publish the open observation, check the answer, move; return False without one."""
        observation = self._played.observation
        self._played.publish(observation)
        answered = self._check_end(observation) if observation.terminated else \
            self._check_advice(observation)
        self._move()
        return answered

    def _check_end(self, observation: StateReward) -> bool:
        self._played.wait(observation, QUIET)
        answers = self._played.answers(observation)
        self.report.check('M4', not answers, 'no recommendation where the episode has ended by '
                          'terminated', f'{len(answers)} of them', observation, *answers)
        return True

    def _check_advice(self, observation: StateReward) -> bool:
        played, check = self._played, self.report.check
        if not check('M1', played.wait(observation, self._patience), 'a recommendation for each '
                     'new observation that is not terminated', f'none within {self._patience:g} s',
                     observation):
            return False
        answer, world = played.answers(observation)[0], played.world
        self._first = self._first or answer
        self._went_without |= answer.action == NO_ACTION
        check('P3', answer.state == observation.state, 'a recommendation with the state of its '
              f'observation, {observation.state}', f'state {answer.state}', observation, answer)
        check('M3', answer.action == NO_ACTION or 0 <= answer.action < world.n_actions
              and world.available[observation.state, answer.action],
              'an action that the state has, or NO_ADVICE',
              f'action {answer.action} in state {observation.state}', observation, answer)
        check('M5', answer.mentor == '', 'an empty field mentor', repr(answer.mentor), answer)
        return True

    def _check_repeated(self) -> bool:
        """Do as `_check_answer`, but publish the observation once more before the move."""
        observation, played = self._played.observation, self._played
        if observation.terminated:
            return self._check_answer()
        played.publish(observation)
        if not self._check_advice(observation):
            return False
        count = len(played.answers(observation))
        played.publish(observation)
        self.report.check('M2', played.wait(observation, self._patience, count + 1),
                          'a recommendation again, when an observation is repeated',
                          f'none within {self._patience:g} s', observation,
                          *played.answers(observation))
        self._move()
        return True

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
        self.report.check('M6', kept, 'the advice in all states on mentor_policy',
                          f'{len(policies)} messages of this run', *policies)

    def _check_budget(self) -> None:
        """After a reset: there is advice in the first state, if there was and it ran out."""
        answers, first = self._played.answers(self._played.observation), self._first
        if first and first.action != NO_ACTION and self._went_without and answers:
            self.report.check('M7', answers[0].action != NO_ACTION, 'advice in the first state, '
                              'as in the run before the reset', 'none', first, answers[0])
