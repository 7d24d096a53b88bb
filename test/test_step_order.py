# SPDX-License-Identifier: Apache-2.0
"""Which question may be the next, and what happens to the others."""

import pytest
from test_learner import state
from tiny_worlds import room

from comply_ros.protocol.messages import Inactive, Notice, Rejected
from comply_ros.protocol.turns import OF_ANOTHER, Turns

ROOM = room()


def after(*asked, **settings):
    """Return the turns of one that has answered these questions."""
    turns = Turns(**settings)
    for each in asked:
        turns.take(each)
    return turns


def test_who_has_answered_nothing_takes_the_first_question_at_once_and_any_other_asked_again():
    assert Turns().remark(state(), ROOM) is None
    turns, late = Turns(), state(episode=9, step=3, s=4)
    assert turns.remark(late, ROOM).kind == 'joins late'
    assert turns.remark(state(episode=9, step=4, s=4), ROOM).kind == 'joins late'
    assert turns.remark(late, ROOM).kind == 'joins late'
    assert turns.remark(late, ROOM) is None


@pytest.mark.parametrize('msg', [state(step=1, s=1), state(step=1, s=3)])
def test_the_next_question_is_one_move_away(msg):
    assert after(state()).remark(msg, ROOM) is None


@pytest.mark.parametrize('msg', [
    state(), state(step=3, s=1), state(episode=2), state(episode=2, step=1, s=1),
    state(episode=4_000_000_000)])
def test_any_other_turn_is_refused_however_often_it_is_asked(msg):
    turns = after(state(step=0), state(step=1, s=1))
    for _ in range(5):
        remark = turns.remark(msg, ROOM)
        assert (type(remark), remark.kind) == (Rejected, 'question out of turn')
        turns.look()


def test_after_the_end_of_an_episode_comes_the_next_and_nothing_else():
    turns = after(state(step=1, s=8, terminated=True))
    assert turns.remark(state(step=2, s=7), ROOM).kind == 'question out of turn'
    assert turns.remark(state(episode=2), ROOM) is None


def test_who_does_not_hear_every_end_takes_the_next_episode_at_any_time():
    assert after(state(), sees_ends=False).remark(state(episode=2), ROOM) is None
    assert after(state(), sees_ends=False).remark(state(episode=3), ROOM) is not None


def test_a_jump_is_taken_when_it_is_asked_again_and_nothing_came_between():
    turns = after(state())
    jump, move = state(step=1, s=8), state(step=1, s=1)
    assert turns.remark(jump, ROOM).reason == (
        'a state must be one move from the last, 0, got 8: does this world move as it is '
        'described?')
    assert turns.remark(move, ROOM) is None  # the true question
    assert turns.remark(jump, ROOM).kind == 'state out of reach'
    assert turns.remark(jump, ROOM) is None  # a world that moves otherwise


def test_a_gap_is_taken_only_by_who_may_lack_something_and_only_after_a_while():
    turns = after(state())
    turns.may_lack = True
    late = state(step=7, s=4)
    for _ in range(3):
        assert turns.remark(late, ROOM).kind == 'question out of turn'
    turns.look()
    notice = turns.remark(late, ROOM)
    assert notice == Notice('goes on at turn (1, 7) after (1, 0): what lay between was not heard, '
                            'or its journal has lost it')
    turns.take(late)
    assert turns.remark(state(step=20, s=4), ROOM).kind == 'question out of turn'


def test_the_next_question_ends_the_doubt_that_something_is_missing():
    turns = after(state())
    turns.may_lack = True
    assert turns.remark(state(step=1, s=1), ROOM) is None
    assert not turns.may_lack


def test_one_learner_too_many_stands_aside_after_a_score_of_turns_of_another():
    turns = Turns()
    for step in range(OF_ANOTHER - 1):
        for _ in range(3):  # repetitions do not count
            assert turns.leave(state(step=step)._replace(learner=5), 6) == ()
    aside, = turns.leave(state(step=OF_ANOTHER)._replace(learner=5), 6)
    assert aside == Inactive('learner 5 came first and keeps run 7: end this one, 6, or give it a '
                          'world of its own')
    assert turns.aside


def test_an_answer_of_its_own_ends_the_count_of_the_turns_of_another():
    turns = Turns()
    for step in range(OF_ANOTHER - 1):
        turns.leave(state(step=step)._replace(learner=5), 6)
    turns.take(state(step=OF_ANOTHER))
    assert turns.leave(state(step=OF_ANOTHER + 1)._replace(learner=5), 6) == ()
