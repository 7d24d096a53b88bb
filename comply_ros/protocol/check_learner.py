# SPDX-License-Identifier: Apache-2.0
"""A check of a learner: this side plays the world and the mentor."""

from __future__ import annotations

from collections import Counter

from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.messages import Action, ANYONE, Recommendation, StateReward, step_id
from comply_ros.protocol.rule_report import Channel, RuleReport, Verdict
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import Source, World
from comply_ros.world.planning import optimal_policy

RULES = {
    'P3': 'actions belong to an observation', 'P5': 'other protocols are rejected',
    'P9': 'a reset of the world is followed', 'L1': 'one number, which is not 0',
    'L2': 'one run is answered', 'L3': 'one action for each new observation',
    'L4': 'the same action for a repeated one', 'L5': 'earlier observations are ignored',
    'L6': 'those of another learner are not answered',
    'L7': 'actions and confidences are possible',
    'L8': 'the end of an episode needs no advice', 'L11': 'later advice changes nothing',
    'L13': 'no step is skipped', 'L17': 'the learner is described'}
PATIENCE = 10.0  # seconds that an action may take
QUIET = 0.3  # seconds without a message that count as silence
STEPS = 80  # observations that the learner has to answer in a run


class LearnerCheck:
    """
    Lets a learner act in one run, disturbs it, resets, and lets it act again.

    Parameters
    ----------
    source: the world of the check; it needs a model.
    channel: to the learner.
    seed: of the world.

    """

    def __init__(self, source: Source, channel: Channel, seed: int = 0) -> None:
        self._channel, self._world = channel, World(source)
        self._policy = optimal_policy(self._world)
        rng = random_streams(seed)[1]
        self._machine = GridWorld(source, 'check', int(rng.integers(1, 2 ** 32)), seed)
        self._asked: Counter[tuple[int, int, int]] = Counter()
        self._number: int | None = None
        self.report = RuleReport(RULES)

    def run(self) -> tuple[Verdict, ...]:
        """Check the learner; return a verdict on each rule."""
        self._channel.send(self._machine.description)
        disturbances = {8: self._repeat, 14: self._send_late, 20: self._send_of_other_run,
                        26: self._send_for_other_learner, 32: self._advise_again,
                        38: self._skip_a_step, 50: self._repeat}
        for number in range(STEPS):
            before = self._machine.observation
            if number in (26, 38):  # these come before the observation
                disturbances[number](before)
            action = self._ask(before)
            if action is None:
                break
            if number in disturbances and number not in (26, 38):
                disturbances[number](before)
            self._machine.on_action(action)
            if not self.report.check(
                    'L7', self._machine.observation != before, 'an action that the world accepts',
                    f'action {action.action}, followed {action.followed}', before, action):
                break
        else:
            self._check_reset()
            self._check_protocol()
        self._check_reports()
        return self.report.verdicts()

    def _answers(self, observation: StateReward) -> list[Action]:
        return [each.message for each in self._channel.heard['Action']
                if each.message[:3] == observation[:3]]

    def _publish(self, observation: StateReward) -> None:
        self._asked[observation[:3]] += 1
        self._channel.send(observation)

    def _ask(self, observation: StateReward) -> Action | None:
        """Publish an observation and its recommendation; return the checked answer, or None."""
        check, rule = self.report.check, 'L3'
        self._publish(observation)
        if observation.terminated:
            rule = 'L8'  # it must not wait for a recommendation
        else:
            self._channel.send(self._advice(observation))
        answered = self._channel.wait(lambda: self._answers(observation), PATIENCE)
        if not check(rule, answered, 'an action for each new observation' + (
                ', without a recommendation where it is terminated' if rule == 'L8' else ''),
                f'none within {PATIENCE:g} s', observation):
            return None
        action = self._answers(observation)[0]
        self._check_action(observation, action)
        return action

    def _advice(self, observation: StateReward) -> Recommendation:
        return Recommendation(*observation[:4], int(self._policy[observation.state]))

    def _check_action(self, observation: StateReward, action: Action) -> None:
        check = self.report.check
        over = observation.terminated or observation.truncated
        possible = action.action == NO_ACTION if over else (
            0 <= action.action < self._world.n_actions
            and self._world.available[observation.state, action.action])
        check('L7', possible, 'NONE where the episode is over, else an action that the state has',
              f'action {action.action} in state {observation.state}', observation, action)
        check('L7', 0.0 <= action.confidence <= 1.0, 'a confidence in [0, 1]', action.confidence,
              observation, action)
        if self._number is None:
            self._number = action.learner
        check('L1', action.learner == self._number != ANYONE, 'one number, which is not 0',
              action.learner, action)

    def _repeat(self, observation: StateReward) -> None:
        self._check_same(observation, 'L4', 'the same action again, when an observation is '
                         'repeated')

    def _check_same(self, observation: StateReward, rule: str, expected: str) -> None:
        before = self._answers(observation)
        self._publish(observation)
        again = self._channel.wait(
            lambda: len(self._answers(observation)) > len(before), PATIENCE)
        last = self._answers(observation)[-1]
        self.report.check(rule, again and last == before[0], expected, last if again else
                          f'none within {PATIENCE:g} s', observation, before[0], last)

    def _check_silent(self, observation: StateReward, rule: str, expected: str) -> None:
        """Publish an observation that must not be answered."""
        count = len(self._answers(observation))
        self._channel.send(observation)
        answered = self._channel.wait(lambda: len(self._answers(observation)) > count, QUIET)
        self.report.check(rule, not answered, expected, 'an action', observation,
                          *self._answers(observation)[count:])
        self._asked[observation[:3]] += 0

    def _send_late(self, observation: StateReward) -> None:
        earlier = [key for key in self._asked if key[1:] < step_id(observation)]
        run, episode, step = max(earlier)
        self._check_silent(observation._replace(run=run, episode=episode, step=step), 'L5',
                           'no action for an observation before the last one')

    def _send_of_other_run(self, observation: StateReward) -> None:
        other = observation.run % (2 ** 32 - 2) + 1
        self._check_silent(observation._replace(run=other, step=observation.step + 1), 'L2',
                           'no action in a run that nobody has described')

    def _send_for_other_learner(self, observation: StateReward) -> None:
        assert self._number is not None
        self._check_silent(observation._replace(learner=self._number % (2 ** 32 - 2) + 1), 'L6',
                           'no action for a new observation of another learner')

    def _skip_a_step(self, observation: StateReward) -> None:
        self._check_silent(observation._replace(step=observation.step + 2), 'L13',
                           'no action for an observation that skips a step')

    def _advise_again(self, observation: StateReward) -> None:
        """Recommend something else after the answer: the answer must stay."""
        if observation.terminated:
            return
        advice = self._advice(observation)
        others = [a for a in self._world.available[observation.state].nonzero()[0].tolist()
                  if a != advice.action]
        if not others:
            return
        self._channel.send(advice._replace(action=others[-1]))
        self._check_same(observation, 'L11', 'the same action again, after another '
                         'recommendation for the observation')

    def _check_reset(self) -> None:
        before = self._machine.description.run
        for each in self._machine.reset(before % (2 ** 32 - 2) + 1, 0):
            if hasattr(each, 'protocol'):
                self._channel.send(each)
        observation = self._machine.observation
        self._publish(observation)
        self._channel.send(self._advice(observation))
        followed = self._channel.wait(lambda: self._answers(observation), PATIENCE)
        self.report.check('P9', followed, 'an action in a run that replaces the one before',
                          f'none within {PATIENCE:g} s', self._machine.description, observation)

    def _check_protocol(self) -> None:
        description = self._machine.description
        other = description.run % (2 ** 32 - 2) + 1
        self._channel.send(description._replace(
            protocol=description.protocol + 90, run=other, replaces=description.run))
        self._check_silent(self._machine.observation._replace(run=other), 'P5',
                           'no action in a world of another protocol')

    def _check_reports(self) -> None:
        """Check what was heard in the whole run."""
        heard, check = self._channel.heard, self.report.check
        actions = heard['Action']
        if not actions:
            return
        strange = [each.message for each in actions if each.message[:3] not in self._asked]
        check('P3', not strange, 'actions with run, episode and step of an observation',
              f'{len(strange)} of another one', *strange)
        counts = Counter(each.message[:3] for each in actions)
        twice = [each.message for each in actions
                 if counts[each.message[:3]] > self._asked[each.message[:3]] > 0]
        check('L3', not twice, 'exactly one action for a new observation', f'{len(twice)} actions '
              'for observations that were published less often', *twice)
        descriptions = [each for each in heard['LearnerDescription']
                        if each.message.learner == self._number]
        check('L17', descriptions and descriptions[0].time <= actions[0].time + QUIET,
              'a LearnerDescription before the first action', f'{len(descriptions)} of them',
              actions[0].message)
