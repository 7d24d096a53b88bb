# SPDX-License-Identifier: Apache-2.0
"""Our learners pass the check of a learner, and one that breaks a rule fails just that rule."""

from dataclasses import replace

from check_channels import LearnerChannel
from check_results import only, results, ROOM, unchanged
from following_nodes import FOLLOWING
import pytest
from tiny_worlds import grid

from comply_ros.learner.presets import find_method
from comply_ros.protocol.check_learner import LearnerCheck, RULES
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.messages import Action, LearnerDescription, step_id
from comply_ros.protocol.rule_report import FAIL, NOT_REACHED
from comply_ros.protocol.run_tracker import BEFORE_FIRST, FIRST


def learner_of(method='explicit', machine=Learner, measuring_iterations=0):
    """Return a learner; in an iteration that only measures, it learns nothing."""
    config = replace(find_method(method, 'published'), measuring_iterations=measuring_iterations)
    return machine(config, seed=3, number=9)


def checked_learner(change=unchanged, machine=Learner, method='explicit', measuring_iterations=0,
                    source=ROOM, **options):
    learner = learner_of(method, machine, measuring_iterations)
    return LearnerCheck(source, LearnerChannel(learner, change, **options), seed=2).run()


@pytest.mark.parametrize('method', ['explicit', 'beta_implicit', 'jump_start'])
def test_our_learner_passes_every_rule(method):
    assert results(checked_learner(method=method)) == {FAIL: [], NOT_REACHED: []}


class Eager(Learner):
    """Learns from each repetition."""

    def observe(self, msg):
        if msg.run == self.tracker.run and step_id(msg) == self.tracker.answered:
            self.state.q[...] += 0.1
        return super().observe(msg)


class Promiscuous(Learner):
    """Answers the first observation of a run that nobody has described."""

    fallen = False

    def observe(self, msg):
        if self.fallen or msg.run == self.tracker.run:
            return super().observe(msg)
        self.fallen = True
        return (Action(*msg[:3], 0, False, 0.0, self.number),)


class Forgetful(Learner):
    """Answers a repeated observation with nothing."""

    def observe(self, msg):
        repeated = msg.run == self.tracker.run and step_id(msg) == self.tracker.answered
        return () if repeated else super().observe(msg)


class Chatty(Learner):
    """Answers an observation before the last one."""

    def observe(self, msg):
        if msg.run == self.tracker.run and step_id(msg) < self.tracker.answered:
            return (Action(*msg[:3], 0, False, 0.0, self.number),)
        return super().observe(msg)


class Hasty(Learner):
    """Answers observations of another learner."""

    def observe(self, msg):
        return super().observe(msg._replace(learner=0))


class Hesitant(Learner):
    """Waits for advice where the episode is over."""

    def observe(self, msg):
        return () if msg.terminated else super().observe(msg)


class Mute(Learner):
    """Answers nothing while it waits."""

    def observe(self, msg):
        waiting = self.waiting and step_id(self.waiting) == step_id(msg)
        return () if waiting and msg.run == self.tracker.run else super().observe(msg)


class Gullible(Learner):
    """Follows any recommendation while it waits."""

    def on_recommendation(self, msg, m=0):
        if self.waiting:
            msg = msg._replace(**dict(zip(('run', 'episode', 'step', 'state'), self.waiting)))
        return super().on_recommendation(msg, m)


class Undecided(Learner):
    """Changes its action when there is another recommendation."""

    def on_recommendation(self, msg, m=0):
        answer = self._repeated
        if answer.action and msg.run == self.tracker.run and step_id(msg) == step_id(
                answer.action) and msg.action != answer.action.advice >= 0:
            answer.action = answer.action._replace(action=msg.action, followed=False)
        return super().on_recommendation(msg, m)


class Joining(Learner):
    """Answers the first observation that it receives, wherever that is."""

    def observe(self, msg):
        if msg.run == self.tracker.run and self.tracker.answered == BEFORE_FIRST \
                and step_id(msg) != FIRST and not self.waiting:
            super().observe(msg)
        return super().observe(msg)


class Leaping(Learner):
    """Answers an observation that skips a step."""

    def observe(self, msg):
        episode, step = self.tracker.answered
        if msg[:2] == (self.tracker.run, episode) and msg.step > step + 1 > 0:
            self.tracker.answered = (episode, msg.step - 1)
            self.tracker.expected = None
        return super().observe(msg)


class Greedy(Learner):
    """Learns from the reward with which it joins."""

    def observe(self, msg):
        if msg.run == self.tracker.run and self.tracker.answered == BEFORE_FIRST and msg.step:
            self.state.q[...] += msg.reward
        return super().observe(msg)


class Fresh(Learner):
    """Forgets what it learned in each new run."""

    def _start_run(self, is_reset):
        outputs = super()._start_run(is_reset)
        self.agent.reset()
        return outputs


class Moody(Learner):
    """Remembers how often it was reset."""

    resets = 0

    def reset(self):
        self.resets += 1
        return super().reset()

    def _answer(self, advice):
        self.state.q[...] += 0.01 * self.resets
        return super()._answer(advice)


def action(change):
    """Return a change of actions."""
    return {'change': only(Action, change)}


BROKEN = {
    'P3': {'change': lambda msg: (msg, msg._replace(episode=99)) if isinstance(msg, Action)
           else (msg,)},
    **{rule: {'machine': type(rule, (node, Learner), {})} for rule, node in FOLLOWING.items()},
    'P6': {'machine': Eager},
    'L1': action(lambda msg: msg._replace(learner=77) if msg.step == 4 else msg),
    'L2': {'machine': Promiscuous},
    'L3': {'change': lambda msg: (msg, msg) if isinstance(msg, Action) else (msg,)},
    'L4': {'machine': Forgetful}, 'L5': {'machine': Chatty}, 'L6': {'machine': Hasty},
    'L7': action(lambda msg: msg._replace(confidence=1.5)), 'L8': {'machine': Hesitant},
    'L9': {'machine': Mute}, 'L10': {'machine': Gullible}, 'L11': {'machine': Undecided},
    'L12': {'machine': Joining}, 'L13': {'machine': Leaping}, 'L14': {'machine': Greedy},
    'L15': {'machine': Fresh}, 'L17': {'change': only(LearnerDescription, lambda msg: None)},
    'L18': action(lambda msg: msg._replace(followed=True)), 'L19': {'machine': Moody}}


def test_each_rule_of_a_learner_has_a_learner_that_breaks_it():
    assert BROKEN.keys() == RULES.keys()


@pytest.mark.parametrize('rule', BROKEN)
def test_a_learner_that_breaks_a_rule_fails_just_that_rule(rule):
    assert results(checked_learner(**BROKEN[rule]))[FAIL] == [rule]


def test_what_needs_a_learner_that_starts_anew_is_not_reached_without():
    assert results(checked_learner(resets=False)) == {FAIL: [], NOT_REACHED: ['P6', 'L14', 'L19']}


@pytest.mark.parametrize('limit', [1, 3])
def test_what_needs_the_middle_of_an_episode_is_not_reached_where_they_are_shorter(limit):
    found = results(checked_learner(source=grid('..G', '...', starts=(0, 1), limit=limit)))
    assert found[FAIL] == [] and {'L12', 'L14'} <= set(found[NOT_REACHED])


def test_what_is_about_learning_is_not_reached_by_a_learner_that_only_measures():
    found = results(checked_learner(measuring_iterations=1))
    assert found == {FAIL: [], NOT_REACHED: ['L14', 'L15']}


def test_what_is_about_advice_is_not_reached_by_a_learner_without_a_mentor():
    assert results(checked_learner(method='q_learning'))[FAIL] == []
    assert {'L9', 'L10'} <= set(results(checked_learner(method='q_learning'))[NOT_REACHED])


def test_a_second_check_of_the_same_learner_finds_the_same():
    channel = LearnerChannel(learner_of())
    LearnerCheck(ROOM, channel, seed=2).run()
    assert results(LearnerCheck(ROOM, channel, seed=2).run())[FAIL] == []
