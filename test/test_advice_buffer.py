# SPDX-License-Identifier: Apache-2.0
"""Advice counts where it belongs to a question that was asked."""

from test_learner import advice, state
from tiny_worlds import room

from comply_ros.protocol.advice_buffer import AdviceBuffer, QUESTIONS

ROOM, RUN = room(), 7


def asked(*questions):
    """Return what was heard by one that was asked these questions."""
    hearsay = AdviceBuffer(RUN)
    for each in questions:
        assert hearsay.ask(each) is None
    return hearsay


def test_advice_for_a_question_counts_and_is_the_newest_word():
    hearsay = asked(state(), state(step=1, s=1), state(step=2, s=0))
    assert hearsay.hear(advice(step=2, action=1), ROOM) == (True, ())
    assert hearsay.hear(advice(step=0, action=3), ROOM) == (False, ())  # late, and older
    assert hearsay.last(0).action == 1
    assert hearsay.advice(9).tolist() == [1, -1, -1, -1, -1, -1, -1, -1, -1]


def test_advice_for_another_state_than_was_asked_about_is_refused():
    hearsay = asked(state())
    counts, (refused,) = hearsay.hear(advice(s=1), ROOM)
    assert not counts
    assert refused.reason == 'a recommendation in turn (1, 0) must be for state 0, got 1'
    assert hearsay.last(1) is None


def test_advice_that_comes_before_its_question_waits_for_it():
    hearsay = asked(state())
    assert hearsay.hear(advice(step=1, s=1), ROOM) == (False, ())
    assert hearsay.last(1) is None
    assert hearsay.ask(state(step=1, s=1)) == advice(step=1, s=1)
    assert hearsay.ask(state(step=2, s=2)) is None


def test_advice_for_no_question_is_refused_when_another_takes_its_place():
    hearsay = asked(state())
    hearsay.hear(advice(episode=90), ROOM)
    _, (refused,) = hearsay.hear(advice(step=1, s=1), ROOM)
    assert refused.reason == ('a recommendation must be for a question that was asked, got turn '
                              '(90, 0) after turn (1, 0)')


def test_advice_for_a_question_long_past_is_dropped():
    hearsay = asked(*(state(step=step, s=step % 2) for step in range(QUESTIONS + 1)))
    _, (dropped,) = hearsay.hear(advice(), ROOM)
    assert dropped.kind == 'advice too late'
    assert hearsay.hear(advice(step=1, s=1), ROOM) == (True, ())


def test_what_was_heard_comes_back_from_its_arrays():
    before, after = asked(state(), state(step=1, s=1)), AdviceBuffer(RUN, (1, 1))
    before.hear(advice(), ROOM)
    before.hear(advice(step=1, s=1, action=-1), ROOM)
    after.restore(before.arrays())
    assert (after.last(0), after.last(1)) == (advice(), advice(step=1, s=1, action=-1))
