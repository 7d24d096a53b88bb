# SPDX-License-Identifier: Apache-2.0
"""How long a learner waits for each mentor: who is overdue, and which timeouts cannot be."""

from math import inf, nan

import pytest

from comply_ros.learner.learner_config import ConfigError
from comply_ros.protocol.advice_timeouts import AdviceTimeouts

NAMES = ('anna', 'bob', 'carl')


def test_each_mentor_has_its_own_timeout_and_the_others_that_of_all():
    timeouts = AdviceTimeouts(3.0, (0.5, 0.0, 2.0), NAMES)
    assert [timeouts.of(name) for name in (*NAMES, 'found')] == [0.5, 3.0, 2.0, 3.0]
    assert timeouts.shortest() == 0.5


def test_one_number_is_for_all_mentors_that_were_named():
    timeouts = AdviceTimeouts(0.0, (0.5,), NAMES)
    assert [timeouts.of(name) for name in (*NAMES, 'found')] == [0.5, 0.5, 0.5, 0.0]


def test_without_numbers_of_their_own_all_have_that_of_all():
    assert AdviceTimeouts(4.0, (0.0,), NAMES).shortest() == 4.0
    assert AdviceTimeouts(0.0, (0.0,), NAMES).shortest() == 0.0


def test_who_is_missing_is_overdue_from_its_timeout_on():
    timeouts = AdviceTimeouts(0.0, (0.5, 0.0, 2.0), NAMES)
    assert timeouts.overdue(NAMES, 0.49) == []
    assert timeouts.overdue(NAMES, 0.5) == ['anna']
    assert timeouts.overdue(('bob', 'carl'), 2.0) == ['carl']
    assert timeouts.overdue(('bob',), 1e9) == []  # without a limit


def test_the_log_says_who_did_not_answer_in_time():
    timeouts = AdviceTimeouts(0.25, (0.5, 0.0, 2.0), NAMES)
    assert timeouts.reason(['anna', 'bob']).reason == (
        'no recommendation of anna, bob came within 0.5 s: continues as without advice')
    assert timeouts.reason(['']).reason == (
        'no recommendation came within 0.25 s: continues as without advice')


@pytest.mark.parametrize('given', [[], [1.0, 2.0], [1.0, 2.0, 3.0, 4.0]])
def test_another_number_of_timeouts_than_mentors_is_refused(given):
    with pytest.raises(ConfigError) as error:
        AdviceTimeouts(0.0, given, NAMES)
    assert str(error.value) == ("advice_timeouts must have one number for each of the mentors "
                                f"['anna', 'bob', 'carl'], or one for all, got {given}")


@pytest.mark.parametrize('wrong', [-0.1, nan, inf, 3600.5])
def test_a_timeout_that_is_no_time_to_wait_is_refused(wrong):
    with pytest.raises(ConfigError) as error:
        AdviceTimeouts(0.0, [1.0, wrong, 0.0], NAMES)
    assert str(error.value) == ('advice_timeouts must have numbers of seconds in [0.0, 3600.0], '
                                f'got [1.0, {wrong}, 0.0]')
