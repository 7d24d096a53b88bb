# SPDX-License-Identifier: Apache-2.0
"""One world at a time: another only when this one is silent and that one asks."""

import pytest
from test_learner import HERE, state

from comply_ros.protocol.attention import ASKED, Attention, RIVALS, SILENCE

FIRST, SECOND = HERE._replace(run=1, began=10.0), HERE._replace(run=2, began=20.0)


def hear(msg):
    """Hear nothing."""
    return (msg,)


@pytest.fixture
def attention():
    """Return the attention of one that attends to the first world and has answered there."""
    attention = Attention()
    assert attention.prefers(FIRST)
    attention.attend(FIRST)
    attention.committed = True
    return attention


def test_the_first_world_is_attended_to_and_a_second_is_not(attention):
    assert attention.run == 1
    assert not attention.prefers(SECOND)


def test_an_earlier_world_is_preferred_only_while_nothing_was_answered(attention):
    earlier = HERE._replace(run=3, began=5.0)
    assert not attention.prefers(earlier)
    attention.committed = False
    assert attention.prefers(earlier)


@pytest.mark.parametrize('asked, silent, instead', [
    (ASKED, SILENCE, SECOND), (ASKED - 1, SILENCE, None), (ASKED, SILENCE - 1, None)])
def test_another_world_takes_over_when_it_asks_and_this_one_is_silent(attention, asked, silent,
                                                                      instead):
    attention.prefers(SECOND)
    for _ in range(asked):
        attention.hold(hear, state(run=2), 'a state')
    assert [attention.look() for _ in range(silent)][-1] == instead


def test_a_world_that_was_not_described_never_takes_over(attention):
    for _ in range(10):
        attention.hold(hear, state(run=2), 'a state')
        assert attention.look() is None


def test_what_was_held_is_heard_in_the_world_that_it_belongs_to(attention):
    attention.prefers(SECOND)
    attention.hold(hear, state(run=2), 'a state')
    assert attention.attend(SECOND) == [(hear, state(run=2))]
    assert attention.held == {}


def test_what_was_held_is_refused_when_this_world_goes_on(attention):
    attention.prefers(SECOND)
    for _ in range(ASKED):
        attention.hold(hear, state(run=2), 'a state')
    refused, = attention.refuse_held()
    assert refused.reason == 'a state must belong to run 1 of the world here, got run 2'
    assert attention.look() is attention.look() is None  # and its questions are forgotten


def test_a_held_message_of_another_run_yet_is_refused(attention):
    assert attention.hold(hear, state(run=2), 'a state') == ()
    assert attention.hold(hear, state(run=2), 'a state') == ()
    refused, = attention.hold(hear, state(run=3), 'a state')
    assert refused.reason.endswith('got run 2')


def test_no_more_worlds_are_remembered_than_a_few(attention):
    for run in range(2, 3 * RIVALS):
        attention.prefers(HERE._replace(run=run, began=20.0))
        attention.hold(hear, state(run=run), 'a state')
    assert len(attention._rivals) == RIVALS
    assert len(attention._asked) <= RIVALS
