# SPDX-License-Identifier: Apache-2.0
"""The mentor as a state machine: messages in every order, without ROS."""

from itertools import permutations

import pytest
from room_messages import (
    advice,
    make_mentor,
    ROOM_MSG,
    RUN,
    state,
    types,
    UP_EVERYWHERE,
)

from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Action, Ignored, ReceivedAction, Recommendation


@pytest.mark.parametrize('order', list(permutations(('world', 'policy', 'state'))))
def test_it_answers_the_first_observation_in_any_order(order):
    mentor, outputs = Mentor(), []
    for name in order:
        if name == 'world':
            assert mentor.on_world(ROOM_MSG)
        elif name == 'state':
            outputs += mentor.observe(state())
        elif mentor.world is not None:
            outputs += mentor.use(UP_EVERYWHERE)
    if mentor.policy is None:  # it cannot be made before the world is known
        outputs += mentor.use(UP_EVERYWHERE)
    assert outputs == [advice()]


def test_a_repeated_observation_gets_the_same_recommendation():
    mentor = make_mentor()
    assert mentor.observe(state()) == mentor.observe(state()) == (advice(),)


def test_it_answers_requests_for_advice_in_a_state():
    mentor = make_mentor()
    assert mentor.advice(0) == 3
    assert mentor.advice(8) == -1
    with pytest.raises(ValueError, match=r'a state must lie in \[0, 8\], got 9'):
        mentor.advice(9)
    with pytest.raises(ValueError, match='must have a world and a policy first'):
        Mentor().advice(0)


def test_it_says_what_it_waits_for():
    assert Mentor().waiting_for() == 'a world: is a grid_world running?'
    mentor = make_mentor()
    assert mentor.waiting_for() is None
    for _ in range(5):
        mentor.tick()
    assert mentor.waiting_for() == ("the next state of world 'room': is its grid_world running, "
                                    'and not paused?')


def test_a_mentor_that_counts_mistakes_advises_again_after_the_learner_continued_without_it():
    mentor = make_mentor(budget=9, mode='mistakes')
    mentor.observe(state())
    held, action = state(step=5, s=1), Action(RUN, 1, 4, 3, False, 0.0, learner=5)
    assert mentor.observe(held) == ()  # it has not received the action in the first state
    assert mentor.on_action(action) == ()
    assert types(mentor.observe(held)) == [Ignored]
    assert types(mentor.observe(held)) == [Recommendation]


def test_a_mentor_that_counts_mistakes_and_lost_the_end_of_an_episode_advises_in_the_next():
    mentor = make_mentor(budget=9, mode='mistakes')
    mentor.observe(state())
    mentor.allow_gap()
    assert mentor.observe(state(episode=2)) == ()
    for _ in range(2):
        mentor.on_action(Action(RUN, 1, 7, -1, False, 0.0, learner=5))
        mentor.tick()
    mentor.on_action(Action(RUN, 1, 7, -1, False, 0.0, learner=5))
    outputs = [*mentor.observe(state(episode=2)), *mentor.observe(state(episode=2))]
    assert types(outputs) == [Ignored, Recommendation]


def test_a_mentor_that_counts_mistakes_accepts_the_action_of_a_learner_that_replaced_another():
    mentor = make_mentor(budget=9, mode='mistakes')
    mentor.observe(state()._replace(learner=5))
    mentor.observe(state())  # that learner is gone
    mentor.on_action(Action(RUN, 1, 0, 3, False, 0.0, 6))
    following = state(step=1, s=3, reward=-1.0)._replace(learner=6)
    assert types(mentor.observe(following)) == [Recommendation]


@pytest.mark.parametrize('wrong', [{'action': 99}, {'confidence': float('nan')}, {'action': 0}])
def test_a_mentor_that_counts_mistakes_ignores_actions_that_the_world_rejects(wrong):
    mentor = make_mentor(budget=5, mode='mistakes')
    mentor.observe(state())
    right = Action(RUN, 1, 0, 3, False, 0.0)
    mentor.on_action(right._replace(**wrong))
    assert mentor.journal_entries == [state()]
    mentor.on_action(right)
    assert mentor.journal_entries == [state(), ReceivedAction(*right[:9])]


@pytest.mark.parametrize('msg, kind', [
    (state(episode=4_000_000_000, step=7, s=5), 'joins late'),
    (state(episode=1, step=1, s=4), 'state too late')])
def test_a_mentor_spends_nothing_on_a_step_id_that_cannot_be(msg, kind):
    mentor = make_mentor(budget=2)
    mentor.observe(state())
    mentor.observe(state(episode=2, step=3, s=1))
    mentor.journal_entries.clear()
    assert [each.kind for each in mentor.observe(msg)] == [kind]
    assert mentor.journal_entries == []


@pytest.mark.parametrize('other_began', [-1e300, 0.0, 1e300])
@pytest.mark.parametrize('observed', [False, True])
def test_it_keeps_the_first_world_that_it_receives_whenever_the_worlds_began(
        other_began, observed):
    mentor = make_mentor()
    if observed:
        mentor.observe(state(step=1, s=1, reward=-1.0))
    assert mentor.on_world(ROOM_MSG._replace(run=8, began=other_began)) == ()
    assert mentor.tracker.run == RUN
