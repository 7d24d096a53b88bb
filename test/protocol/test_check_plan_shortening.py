# SPDX-License-Identifier: Apache-2.0
"""A failure is shown by the shortest plan that could be found."""

from check_channels import LearnerChannel
from check_results import ROOM
from test_check_learner import Forgetful, learner_of

from comply_ros.protocol.check_learner import LearnerCheck, PLAN
from comply_ros.protocol.check_plan_shortening import shortest_failure
from comply_ros.protocol.rule_report import FAIL, PASS, Verdict

TEN = tuple('abcdefghij')


def failing_where(shows, tried):
    """Return a check that fails rule W1 at the end of the plans for which `shows` is true."""
    def check(plan):
        tried.append(''.join(plan))
        return (Verdict('W2', PASS), Verdict('W1', FAIL if shows(plan) else PASS,
                                             item=len(plan) - 1, expected=''.join(plan)))
    return check


def shortened(shows, attempts=100):
    """Return the plan that is left of the ten letters, and those that were tried."""
    tried = []
    verdict = Verdict('W1', FAIL, item=7, expected='abcdefgh')
    return shortest_failure(verdict, TEN, failing_where(shows, tried), attempts).expected, tried


def test_what_fails_alone_is_tried_first():
    assert shortened(lambda plan: 'h' in plan) == ('h', ['a', 'h'])


def test_what_needs_two_items_keeps_both():
    assert shortened(lambda plan: {'c', 'h'} <= set(plan))[0] == 'ch'


def test_what_never_fails_again_stays_as_it_was_up_to_the_failure():
    found, tried = shortened(lambda plan: False)
    assert found == 'abcdefgh' and all('i' not in plan for plan in tried)


def test_no_more_plans_are_tried_than_allowed():
    found, tried = shortened(lambda plan: {'c', 'h'} <= set(plan), attempts=3)
    assert len(tried) == 3 and {'c', 'h'} <= set(found)


def test_a_learner_that_answers_no_repetition_is_shown_by_a_single_one():
    channel = LearnerChannel(learner_of(machine=Forgetful))
    long = next(each for each in LearnerCheck(ROOM, channel, 2).run() if each.rule == 'L4')
    short = shortest_failure(long, PLAN, lambda plan: LearnerCheck(ROOM, channel, 2, plan).run())
    assert long.result == short.result == FAIL and len(long.transcript) > 40
    names = [type(each.message).__name__ for each in short.transcript]
    assert names == ['WorldDescription', 'LearnerDescription', 'StateReward', 'Recommendation',
                     'Action', 'StateReward']
