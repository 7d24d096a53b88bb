# SPDX-License-Identifier: Apache-2.0
"""How long a learner waits for each mentor, and who is overdue."""

from comply_ros.protocol.advice_timeouts import AdviceTimeouts

NAMES = ('anna', 'bob', 'carl')
OWN = {'anna': 0.5, 'bob': 0.0, 'carl': 2.0}


def test_each_mentor_has_its_own_timeout_and_the_others_that_of_all():
    timeouts = AdviceTimeouts(3.0, OWN)
    assert [timeouts.of(name) for name in (*NAMES, 'found', '')] == [0.5, 3.0, 2.0, 3.0, 3.0]
    assert [timeouts.has_own(name) for name in (*NAMES, 'found')] == [True, False, True, False]
    assert timeouts.shortest() == 0.5


def test_without_numbers_of_their_own_all_have_that_of_all():
    assert AdviceTimeouts(4.0, {'anna': 0.0}).shortest() == 4.0
    assert AdviceTimeouts(0.0, {'anna': 0.0}).shortest() == 0.0


def test_who_is_missing_is_overdue_from_its_timeout_on():
    timeouts = AdviceTimeouts(0.0, OWN)
    assert timeouts.overdue(NAMES, 0.49) == []
    assert timeouts.overdue(NAMES, 0.5) == ['anna']
    assert timeouts.overdue(('bob', 'carl'), 2.0) == ['carl']
    assert timeouts.overdue(('bob',), 1e9) == []  # without a limit


def test_the_log_says_who_did_not_answer_in_time():
    timeouts = AdviceTimeouts(0.25, OWN)
    assert timeouts.reason(['anna', 'bob']).reason == (
        'no recommendation of anna, bob came within 0.5 s: continues as without advice')
    assert timeouts.reason(['']).reason == (
        'no recommendation came within 0.25 s: continues as without advice')
