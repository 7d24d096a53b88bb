# SPDX-License-Identifier: Apache-2.0
"""A check of a learner: this side plays the world and the mentor."""

from __future__ import annotations

from comply_ros.protocol.messages import Action, ANYONE, Recommendation, StateReward
from comply_ros.protocol.played_world import other_number, PlayedWorld
from comply_ros.protocol.rule_report import Channel, PATIENCE, QUIET, RuleReport, Verdict
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import Source

RULES = {
    'P3': 'actions belong to an observation', 'P5': 'other protocols are rejected',
    'P9': 'a reset of the world is followed', 'L1': 'one number, which is not 0',
    'L2': 'one run is answered', 'L3': 'one action for each new observation',
    'L4': 'the same action for a repeated one', 'L5': 'earlier observations are ignored',
    'L6': 'those of another learner are not answered',
    'L7': 'actions and confidences are possible',
    'L8': 'the end of an episode needs no advice', 'L11': 'later advice changes nothing',
    'L13': 'no step is skipped', 'L17': 'the learner is described'}
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
        self._channel = channel
        self._played = PlayedWorld(source, channel, Action, seed)
        self._number: int | None = None
        self.report = RuleReport(RULES)

    def run(self) -> tuple[Verdict, ...]:
        """Check the learner; return a verdict on each rule."""
        played = self._played
        played.describe()
        before = {26: self._send_for_other_learner, 38: self._skip_a_step}
        after = {8: self._repeat, 14: self._send_late, 20: self._send_of_other_run,
                 32: self._advise_again, 50: self._repeat}
        for number in range(STEPS):
            observation = played.observation
            if number in before:
                before[number](observation)
            action = self._check_answer(observation)
            if action is None:
                break
            if number in after:
                after[number](observation)
            played.machine.on_action(action)
            if not self.report.check(
                    'L7', played.observation != observation, 'an action that the world accepts',
                    f'action {action.action}', observation, action):
                break
        else:
            self._check_reset()
            self._check_silent(played.describe_other_protocol(), 'P5',
                               'no action in a world of another protocol')
        self._check_whole_run()
        return self.report.verdicts()

    def _check_answer(self, observation: StateReward) -> Action | None:
        """Publish an observation and its recommendation; return the checked answer, or None."""
        self._played.publish(observation)
        rule, expected = 'L3', 'an action for each new observation'
        if observation.terminated:
            rule, expected = 'L8', 'an action where it is terminated, without a recommendation'
        else:
            self._channel.send(self._advice(observation))
        answered = self._played.wait(observation, PATIENCE)
        if not self.report.check(rule, answered, expected, f'none within {PATIENCE:g} s',
                                 observation):
            return None
        action: Action = self._played.answers(observation)[0]
        self._check_action(observation, action)
        return action

    def _advice(self, observation: StateReward) -> Recommendation:
        return Recommendation(*observation[:4], int(self._played.best[observation.state]))

    def _check_action(self, observation: StateReward, action: Action) -> None:
        check, world = self.report.check, self._played.world
        over = observation.terminated or observation.truncated
        possible = action.action == NO_ACTION if over else (
            0 <= action.action < world.n_actions
            and world.available[observation.state, action.action])
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
        """Publish an observation again: the answer must be that of before."""
        before = self._played.answers(observation)
        self._played.publish(observation)
        again = self._played.wait(observation, PATIENCE, len(before) + 1)
        last = self._played.answers(observation)[-1]
        self.report.check(rule, again and last == before[0], expected, last if again else
                          f'none within {PATIENCE:g} s', observation, before[0], last)

    def _check_silent(self, observation: StateReward, rule: str, expected: str) -> None:
        """Publish an observation that must not be answered."""
        count = len(self._played.answers(observation))
        self._played.publish(observation)
        answered = self._played.wait(observation, QUIET, count + 1)
        self.report.check(rule, not answered, expected, 'an action', observation,
                          *self._played.answers(observation)[count:])

    def _send_late(self, observation: StateReward) -> None:
        run, episode, step = self._played.published_before(observation)
        self._check_silent(observation._replace(run=run, episode=episode, step=step), 'L5',
                           'no action for an observation before the last one')

    def _send_of_other_run(self, observation: StateReward) -> None:
        self._check_silent(
            observation._replace(run=other_number(observation.run), step=observation.step + 1),
            'L2', 'no action in a run that nobody has described')

    def _send_for_other_learner(self, observation: StateReward) -> None:
        assert self._number is not None
        self._check_silent(observation._replace(learner=other_number(self._number)), 'L6',
                           'no action for a new observation of another learner')

    def _skip_a_step(self, observation: StateReward) -> None:
        self._check_silent(observation._replace(step=observation.step + 2), 'L13',
                           'no action for an observation that skips a step')

    def _advise_again(self, observation: StateReward) -> None:
        """Recommend something else after the answer: the answer must stay."""
        advice = self._advice(observation)
        available = self._played.world.available[observation.state].nonzero()[0].tolist()
        others = [a for a in available if a != advice.action]
        if others and not observation.terminated:
            self._channel.send(advice._replace(action=others[-1]))
            self._check_same(observation, 'L11', 'the same action again, after another '
                             'recommendation for the observation')

    def _check_reset(self) -> None:
        self._played.reset()
        observation = self._played.observation
        self._played.publish(observation)
        self._channel.send(self._advice(observation))
        self.report.check('P9', self._played.wait(observation, PATIENCE),
                          'an action in a run that replaces the one before',
                          f'none within {PATIENCE:g} s', observation)

    def _check_whole_run(self) -> None:
        """Check what was received in the whole run."""
        check, actions = self.report.check, self._channel.received['Action']
        if not actions:
            return
        strange, excess = self._played.strange_answers(), self._played.excess_answers()
        check('P3', not strange, 'actions with run, episode and step of an observation',
              f'{len(strange)} of another one', *strange)
        check('L3', not excess, 'exactly one action for a new observation', f'{len(excess)} '
              'actions for observations that were published less often', *excess)
        descriptions = [each for each in self._channel.received['LearnerDescription']
                        if each.message.learner == self._number]
        check('L17', descriptions and descriptions[0].time <= actions[0].time + QUIET,
              'a LearnerDescription before the first action', f'{len(descriptions)} of them',
              actions[0].message)
