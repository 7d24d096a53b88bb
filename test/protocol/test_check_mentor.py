# SPDX-License-Identifier: Apache-2.0
"""Our mentors pass the check of a mentor, and one that breaks a rule fails just that rule."""

from check_channels import MentorChannel
from check_results import only, results, ROOM, unchanged
from following_nodes import FOLLOWING
import pytest

from comply_ros.protocol.check_mentor import MentorCheck, RULES
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Policy, Recommendation
from comply_ros.protocol.rule_report import FAIL, NOT_REACHED, summary
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy


def checked_mentor(change=unchanged, machine=Mentor, settings=(10, 'early')):
    channel = MentorChannel(machine(*settings), optimal_policy(World(ROOM)), change)
    return MentorCheck(ROOM, channel, seed=2).run()


def test_our_mentor_passes_every_rule():
    assert results(checked_mentor()) == {FAIL: [], NOT_REACHED: []}


@pytest.mark.parametrize('settings', [(), (50, 'mistakes')])
def test_a_budget_that_does_not_run_out_is_not_reached(settings):
    assert results(checked_mentor(settings=settings)) == {FAIL: [], NOT_REACHED: ['M7']}


class Endless(Mentor):
    """Recommends an action where the episode has ended."""

    def observe(self, msg):
        return (Recommendation(*msg[:4], 0),) if msg.terminated else super().observe(msg)


class Thrifty(Mentor):
    """Gives ten recommendations, whatever is reset."""

    given = 0

    def observe(self, msg):
        outputs = super().observe(msg)
        self.given += len(outputs)
        return outputs if self.given <= 10 else tuple(
            each._replace(action=-1) for each in outputs)


def advice(change):
    """Return a change of recommendations."""
    return {'change': only(Recommendation, change)}


def unrepeated():
    """Return a change that leaves every answer out but the first."""
    seen = set()

    def change(msg):
        again = msg[:3] in seen
        seen.add(msg[:3])
        return None if again else msg
    return advice(change)


BROKEN = {
    'P3': advice(lambda msg: msg._replace(state=msg.state + 1)),
    **{rule: {'machine': type(rule, (node, Mentor), {})} for rule, node in FOLLOWING.items()},
    'M1': advice(lambda msg: None if msg.step == 7 else msg), 'M2': unrepeated(),
    'M3': advice(lambda msg: msg._replace(action=4)), 'M4': {'machine': Endless},
    'M5': advice(lambda msg: msg._replace(mentor='mine')),
    'M6': {'change': only(Policy, lambda msg: None)},
    'M7': {'machine': Thrifty, 'settings': ()},
    'M8': {'change': lambda msg: (msg, msg) if isinstance(msg, Recommendation) else (msg,)}}


def test_each_rule_of_a_mentor_has_a_mentor_that_breaks_it():
    assert BROKEN.keys() == RULES.keys()


@pytest.mark.parametrize('rule', BROKEN)
def test_a_mentor_that_breaks_a_rule_fails_just_that_rule(rule):
    assert results(checked_mentor(**BROKEN[rule]))[FAIL] == [rule]


def test_a_mentor_may_change_its_mind():
    answers = set()

    def change(msg):
        again = msg[:3] in answers
        answers.add(msg[:3])
        return msg._replace(action=-1) if again else msg
    assert results(checked_mentor(**advice(change)))[FAIL] == []


def test_a_failure_shows_the_messages_and_the_summary_counts():
    verdicts = checked_mentor(**advice(lambda msg: msg._replace(action=4)))
    failed = next(each for each in verdicts if each.result == FAIL)
    assert 'action 4' in failed.got and len(failed.messages) == 2
    assert summary('mentor /m', verdicts) == 'mentor /m: 12 passed, 1 failed, 1 not reached'


def test_a_second_check_of_the_same_mentor_finds_the_same():
    channel = MentorChannel(Mentor(10, 'early'), optimal_policy(World(ROOM)))
    for _ in range(2):
        assert results(MentorCheck(ROOM, channel, seed=2).run()) == {FAIL: [], NOT_REACHED: []}
