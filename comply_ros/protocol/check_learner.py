# SPDX-License-Identifier: Apache-2.0
"""A check of a learner: this side plays the world and the mentor."""

from __future__ import annotations

from collections.abc import Callable

from comply_ros.protocol.check_followed_world import FollowingCheck
from comply_ros.protocol.check_followed_world import RULES as FOLLOWING
from comply_ros.protocol.check_learner_answers import LearnerAnswers
from comply_ros.protocol.check_learner_answers import RULES as ANSWERS
from comply_ros.protocol.check_learner_faults import LearnerReplays
from comply_ros.protocol.check_learner_faults import RULES as REPLAYS
from comply_ros.protocol.check_plan_shortening import Plan
from comply_ros.protocol.emulated_world import EmulatedWorld, other_number
from comply_ros.protocol.messages import Action, Recommendation, StateReward
from comply_ros.protocol.rule_report import Channel, PATIENCE, QUIET, RuleReport, Verdict
from comply_ros.world.mdp import Source

RULES = {'P3': ANSWERS['P3'], **FOLLOWING, **{rule: title for rule, title in sorted(
    {**ANSWERS, **REPLAYS, 'L2': 'one run is answered', 'L4': 'the same action for a repeated one',
     'L5': 'earlier observations are ignored',
     'L6': 'those of another learner are not answered',
     'L9': 'a repetition is answered while it waits',
     'L10': 'advice counts only for an observation', 'L11': 'later advice changes nothing',
     'L12': 'a learner that joins late waits for a repetition',
     'L13': 'no step is skipped'}.items(),
    key=lambda each: (each[0][0] == 'L', int(each[0][1:]))) if rule != 'P3'}}
# Eighty observations with some disturbances, then other runs and worlds.
PLAN: Plan = (
    'answer', 'digest', *('without advice', 'answer') * 4, 'repeat', *('answer',) * 5, 'late',
    *('answer',) * 5, 'other run', *('answer',) * 5, 'other learner', *('answer',) * 5,
    *('advise again', 'answer') * 3, *('skip', 'answer') * 4, *('answer',) * 6, 'repeat',
    *('answer',) * 24, 'reset', *('answer',) * 10, 'keeps', 'answer', 'join', 'answer', 'early',
    'second world', 'other protocol', 'same transcript', 'joined reward', 'faults')


class LearnerCheck:
    """
    Lets a learner act in one run, disturbs it, resets, and lets it act in other runs.

    Parameters
    ----------
    source: the world of the check; it needs a model.
    channel: to the learner.
    seed: of the world.
    plan: what to do.
    patience: seconds that an answer may take.

    """

    def __init__(self, source: Source, channel: Channel, seed: int = 0, plan: Plan = PLAN,
                 patience: float = PATIENCE) -> None:
        self._channel, self._plan, self._patience = channel, plan, patience
        self._played = EmulatedWorld(source, channel, Action, seed)
        self.report = RuleReport(RULES, channel)
        self._answers = LearnerAnswers(self._played, channel, self.report, patience)
        following = FollowingCheck(self._played, channel, self.report, self._answers.advise,
                                   patience)
        replays = LearnerReplays(self._played, channel, self.report, self._answers, seed)
        self._last: StateReward | None = None  # the observation that was answered last
        self._items: dict[str, Callable[[], object]] = {
            'answer': self._answer, 'without advice': self._check_without_advice,
            'repeat': self._repeat, 'late': self._send_late, 'other run': self._send_of_other_run,
            'other learner': self._send_for_other_learner, 'advise again': self._advise_again,
            'skip': self._skip_a_step, 'reset': following.reset, 'digest': replays.note_digest,
            'keeps': replays.check_keeps,
            'join': self._join, 'early': following.early, 'second world': following.second_world,
            'other protocol': following.other_protocol,
            'same transcript': replays.check_same_transcript,
            'joined reward': replays.check_joined_reward, 'faults': replays.check_faults}

    def run(self) -> tuple[Verdict, ...]:
        """Check the learner; return a verdict on each rule."""
        self._played.describe()
        self.report.follow(self._plan, lambda item: self._items[item]())
        self._answers.check_whole_run()
        return self.report.verdicts()

    def _answer(self) -> bool:
        """Publish the open observation with advice, check the answer, move by it."""
        observation = self._played.observation
        self._played.publish(observation)
        if not observation.terminated:
            self._answers.advise(observation)
        return self._move(observation)

    def _move(self, observation: StateReward) -> bool:
        """Wait for the answer to an observation, check it, move by it; return False without."""
        action = self._answers.checked(observation)
        self._last = observation
        return action is not None and self._answers.move(action)

    def _check_without_advice(self) -> bool:
        """Hold the advice in a new state back: a learner that waits for it waits for no other."""
        observation, before, played = self._played.observation, self._last, self._played
        if observation.terminated or observation.truncated or before is None \
                or self._answers.was_advised(observation.state):
            return self._answer()
        played.publish(observation)
        if played.wait(observation, QUIET):
            return self._move(observation)  # it does not wait
        self._send_wrong_advice(observation)
        if not before.terminated:
            self._check_answer_while_waiting(observation, before)
        self._answers.advise(observation)
        return self._move(observation)

    def _send_wrong_advice(self, observation: StateReward) -> None:
        right = self._answers.advice(observation)
        other = other_number(observation.run)
        for wrong in (right._replace(step=right.step + 1), right._replace(run=other),
                      right._replace(state=self._last.state if self._last else 0)):
            if wrong[:4] != right[:4]:
                self._channel.send(wrong)
                self._channel.wait(lambda: self._played.answers(observation), QUIET)
                self.report.check(
                    'L10', not self._played.answers(observation), 'no action on a recommendation '
                    'for another run, step or state', 'an action', observation, wrong,
                    *self._played.answers(observation))

    def _check_answer_while_waiting(self, observation: StateReward, before: StateReward) -> None:
        """Repeat an observation that waits for advice: the action before must come again."""
        played, count = self._played, len(self._played.answers(before))
        played.publish(observation)
        came = self._channel.wait(lambda: len(played.answers(before)) > count
                                  or played.answers(observation), self._patience)
        played.allow_answer(before)
        self.report.check('L9', came, 'the last action again, while it waits for a recommendation '
                          'and the observation is repeated', f'none within {self._patience:g} s',
                          before, observation)

    def _repeat(self) -> bool:
        if self._answer() and self._last:
            self._check_same(self._last, 'L4', 'the same action again, when an observation is '
                             'repeated')
            return True
        return False

    def _check_same(self, observation: StateReward, rule: str, expected: str) -> None:
        """Publish the last observation again: the answer must be that of before."""
        before = self._played.answers(observation)
        self._played.publish(observation)
        again = self._played.wait(observation, self._patience, len(before) + 1)
        last = self._played.answers(observation)[-1]
        if rule == 'L11' and not again:
            return  # as L4 says
        self.report.check(rule, again and last == before[0], expected, last if again else
                          f'none within {self._patience:g} s', observation, before[0], last)

    def _check_silent(self, observation: StateReward, rule: str, expected: str) -> bool:
        """Publish an observation that must not be answered; return whether it is not."""
        count = len(self._played.answers(observation))
        self._played.publish(observation)
        if not observation.terminated:
            self._answers.advise(observation)
        answered = self._played.wait(observation, QUIET, count + 1)
        return self.report.check(
            rule, not answered, expected, 'an action', observation,
            *self._played.answers(observation)[count:])

    def _send_late(self) -> None:
        before = self._last and self._played.published_before(self._last)
        if self._last and before:
            self._check_silent(self._last._replace(episode=before[1], step=before[2]), 'L5',
                               'no action for an observation before the last one')

    def _send_of_other_run(self) -> None:
        self._check_silent(self._played.observation._replace(run=self._played.new_run()),
                           'L2', 'no action in a run that nobody has described')

    def _send_for_other_learner(self) -> None:
        number, observation = self._answers.number, self._played.observation
        if number is not None:
            self._check_silent(observation._replace(learner=other_number(number)), 'L6',
                               'no action for a new observation of another learner')

    def _skip_a_step(self) -> bool:
        """Publish the open observation with a later step; return whether it is not answered."""
        here = self._played.observation
        if not here.step or here.terminated or here.truncated \
                or here.step + 2 >= self._played.world.step_limit:
            return True
        return self._check_silent(here._replace(step=here.step + 2), 'L13',
                                  'no action for an observation that skips a step')

    def _advise_again(self) -> None:
        """Recommend something else after the answer: the answer must stay."""
        observation = self._last
        if observation is None or observation.terminated:
            return
        advice: Recommendation = self._answers.advice(observation)
        available = self._played.world.available[observation.state].nonzero()[0].tolist()
        others = [a for a in available if a != advice.action]
        if others:
            self._channel.send(advice._replace(action=others[-1]))
            self._check_same(observation, 'L11', 'the same action again, after another '
                             'recommendation for the observation')
            self._channel.send(advice)

    def _join(self) -> bool:
        """Begin a run in the middle of its first episode: the repetition must be answered."""
        self._played.describe()
        observation = self._answers.skip_to_the_middle()
        if observation is None:
            self._played.describe()
            return True
        self._check_silent(observation, 'L12', 'no action for an observation in the middle of an '
                           'episode, where the learner joins, before it is repeated')
        self._played.publish(observation)
        self._answers.advise(observation)
        self.report.check('L12', self._played.wait(observation, self._patience), 'an action, when '
                          'the first observation of a run is repeated',
                          f'none within {self._patience:g} s', observation)
        return self._move(observation)
