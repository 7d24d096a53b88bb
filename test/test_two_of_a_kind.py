# SPDX-License-Identifier: Apache-2.0
"""Two learners or two worlds on the same topics: the first goes on, the second stands aside."""

from dataclasses import replace
import json

import pytest
from test_learner import advice, HERE, ROOM, ROW, RUN, state, UP_EVERYWHERE

from comply_ros.protocol.grid_world import GridWorld, RELEASE, REMARKS
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Action, ANYONE, Inactive, Recommendation, Rejected
from comply_ros.protocol.turns import OF_ANOTHER


def alone(number):
    """Return a learner that needs no mentor and knows the room."""
    actor = Learner(replace(ROW, trust='none'), seed=0, number=number)
    actor.on_world(HERE)
    return actor


def world(run=RUN, began=0.0):
    """Return a room that asks its first question."""
    return GridWorld(ROOM, 'room', run, seed=0, began=began)


def talk(one, other):
    """Let two worlds hear what they say of themselves until nothing is left; return all of it."""
    msg, waiting = [], [(other, one.description), (one, other.description)]
    while waiting:
        listener, description = waiting.pop(0)
        for reply in listener.on_world(description):
            msg.append(reply)
            if reply == listener.description:
                waiting.append((one if listener is other else other, reply))
        assert len(msg) < 50
    return msg


def test_a_run_keeps_the_first_learner_and_refuses_others():
    here, first, second = world(), alone(5), alone(6)
    question = here.question
    assert question.learner == ANYONE
    (one,), (two,) = first.observe(question), second.observe(question)
    following, = here.on_action(one)
    assert following.learner == 5
    refused, = here.on_action(two)
    assert refused.reason == ('an action must come from learner 5, which keeps this run, got 6: '
                              'is there a second one?')
    assert here.question is following


def test_the_second_learner_learns_nothing_says_nothing_and_stands_aside():
    here, first, second = world(), alone(5), alone(6)
    digest, msg = second.memory.digest(), []
    while not msg:
        question = here.question
        msg = second.observe(question._replace(learner=5))
        action, = first.observe(question)[:1]
        here.on_action(action)
    assert [type(each) for each in msg] == [Inactive]
    assert second.memory.digest() == digest
    assert second.observe(here.question._replace(learner=ANYONE)) == ()
    assert here.question.learner == 5
    assert first.student.steps >= OF_ANOTHER - 5


def test_a_run_whose_learner_gives_no_sign_takes_another():
    here = world()
    here.on_action(Action(RUN, 1, 0, 1, False, 0.0, 5))
    asked, = here.ask_again(RELEASE - 0.1)
    assert asked.learner == 5
    description, asked = here.ask_again(RELEASE + 0.1)
    assert (description, asked.learner) == (here.description, ANYONE)
    late = alone(6)
    late.observe(asked)
    action, = late.observe(asked)
    assert here.on_action(action)[-1].learner == 6


def test_a_learner_that_waits_for_advice_gives_a_sign_of_life():
    actor = Learner(ROW, seed=0, number=5)
    actor.on_world(HERE)
    actor.observe(state())
    first, = actor.on_recommendation(advice())
    assert actor.observe(state(step=1, s=3, reward=-1.0)) == ()
    assert actor.observe(state(step=1, s=3, reward=-1.0)) == (first,)
    here = world()
    here.on_action(first)
    here.on_action(first)
    assert here.signs == 1


def test_without_advice_in_time_the_learner_goes_on_as_with_none():
    waiting, without = (Learner(ROW, seed=0) for _ in range(2))
    for actor in (waiting, without):
        actor.on_world(HERE)
        actor.observe(state())
    assert waiting.go_without_advice() == without.on_recommendation(advice(action=-1))
    assert waiting.go_without_advice() == ()  # nothing is open now
    assert waiting.memory.digest() == without.memory.digest()
    waiting.on_recommendation(advice(action=3))  # it comes late, and counts the next time
    waiting.observe(state(step=1, s=3, reward=-1.0))
    waiting.go_without_advice()
    assert len(waiting.observe(state(step=2, s=0, reward=-1.0))) == 1


@pytest.mark.parametrize('began', [(10.0, 20.0), (20.0, 10.0)])
def test_of_two_worlds_without_answers_the_first_goes_on(began):
    one, other = world(7, began[0]), world(8, began[1])
    first, second = (one, other) if began[0] < began[1] else (other, one)
    msg = talk(one, other)
    assert (first.aside, second.aside) == (False, True)
    aside, = (each for each in msg if isinstance(each, Inactive))
    assert f"another world, 'room', came first and keeps these topics for its run " \
           f'{first.description.run}' in aside.reason
    assert second.ask_again(10.0) == ()
    assert second.on_action(Action(second.question.run, 1, 0, 1, False, 0.0)) == ()


@pytest.mark.parametrize('began', [(10.0, 20.0), (20.0, 10.0)])
def test_a_world_that_is_answered_goes_on_whatever_the_clocks_say(began):
    here, other = world(7, began[0]), world(8, began[1])
    here.on_action(Action(7, 1, 0, 1, False, 0.0, 5))
    talk(here, other)
    assert (here.aside, other.aside) == (False, True)


def test_the_ghost_of_a_world_that_is_gone_is_answered_once_and_then_ignored():
    here = world(8, 20.0)
    assert here.on_world(HERE) == (here.description,)
    assert not here.aside


def test_a_world_that_is_answered_does_not_argue_for_ever():
    here = world()
    here.on_action(Action(RUN, 1, 0, 1, False, 0.0, 5))
    msg = [here.on_world(HERE._replace(run=8)) for _ in range(REMARKS + 5)]
    assert [len(each) for each in msg] == [2] * REMARKS + [0] * 5
    assert msg[0][0] == Rejected('another world', 'run 8 of another world speaks here too: it is '
                                 'told to stand aside')


def test_a_world_that_was_answered_often_enough_is_not_even_read(monkeypatch):
    here, read = world(), []
    monkeypatch.setattr('comply_ros.protocol.grid_world.grid_from_description', read.append)
    for _ in range(REMARKS + 5):
        here.on_world(HERE._replace(run=8))
    assert len(read) <= REMARKS


def test_what_is_no_world_is_no_reason_to_stand_aside():
    here = world(8, 20.0)
    for _ in range(3):
        with pytest.raises(ValueError, match='sha256 must be that of the world'):
            here.on_world(HERE._replace(step_limit=51))
    assert not here.aside


@pytest.mark.parametrize('confidence', [-0.1, 1.1, float('nan'), float('inf')])
def test_a_confidence_that_is_no_probability_is_refused(confidence):
    here = world()
    refused, = here.on_action(Action(RUN, 1, 0, 1, True, confidence))
    assert refused.reason == f'a confidence must lie in [0, 1], got {confidence}'


def test_a_world_whose_learner_was_replaced_comes_back_where_it_was():
    here, run = world(), []
    for number, step in ((5, 0), (6, 1)):
        here.ask_again(RELEASE + 0.1)
        action = next(a for a in range(4) if here._successor[here.question.state, a] >= 0)
        here.on_action(Action(RUN, 1, step, action, False, 0.0, number))
        run.append(here.told.pop())
    back = world()
    back.restore(*world().state(), run)
    assert back.question == here.question
    assert back.question.learner == 6


def test_a_learner_does_not_learn_from_a_move_that_another_made():
    left_out = alone(6)
    left_out.observe(state())
    digest = left_out.memory.digest()
    question = state(step=1, s=1, reward=-1.0)
    assert left_out.observe(question._replace(learner=5)) == ()
    msg = left_out.observe(question)  # its learner is gone, and any may answer
    assert [type(each) for each in msg] == [Action]
    assert left_out.memory.digest() == digest
    assert left_out.student.steps == 0


def test_a_learner_that_was_left_out_takes_part_when_the_other_is_gone():
    left_out = alone(6)
    left_out.observe(state())
    for step in range(1, 5):
        left_out.observe(state(step=step, s=1 + step % 2, reward=-1.0)._replace(learner=5))
    later = state(step=5, s=2, reward=-1.0)
    for _ in range(3):
        assert [each.kind for each in left_out.observe(later)] == ['joins late']
    left_out.look()
    assert [type(each) for each in left_out.observe(later)] == [Action]


def test_a_learner_whose_question_is_asked_again_was_not_left_for_a_turn_far_ahead():
    actor, question = alone(6), state()
    actor.observe(question)
    forged = state(episode=1_029_192, step=7, s=4, reward=-1.0)
    actor.observe(forged._replace(step=6, learner=5))
    for _ in range(9):
        actor.observe(forged)
        actor.look()
        assert [type(each) for each in actor.observe(question)] == [Action]
        actor.observe(forged._replace(step=6, learner=5))
    assert [type(each) for each in actor.observe(state(step=1, s=1, reward=-1.0))] == [Action]


def test_a_watching_mentor_takes_the_action_of_the_learner_that_replaced_another():
    actor = Mentor(budget=9, when='mistakes')
    actor.on_world(HERE)
    actor.use(UP_EVERYWHERE)
    actor.observe(state()._replace(learner=5))
    actor.observe(state())  # that one is gone
    actor.on_action(Action(RUN, 1, 0, 3, False, 0.0, 6))
    following = state(step=1, s=3, reward=-1.0)._replace(learner=6)
    assert [type(each) for each in actor.observe(following)] == [Recommendation]


@pytest.mark.parametrize('msg, kind', [
    (state(episode=4_000_000_000, step=7, s=5), 'joins late'),
    (state(episode=1, step=1, s=4), 'state too late')])
def test_a_mentor_spends_nothing_on_a_turn_that_cannot_be(msg, kind):
    actor = Mentor(budget=2)
    actor.on_world(HERE)
    actor.use(UP_EVERYWHERE)
    actor.observe(state())
    actor.observe(state(episode=2, step=3, s=1))
    actor.told.clear()
    assert [each.kind for each in actor.observe(msg)] == [kind]
    assert actor.told == []


def test_copies_of_advice_are_not_told_again():
    actor = Learner(ROW, seed=0)
    actor.on_world(HERE)
    actor.observe(state())
    actor.on_recommendation(advice())
    told = len(actor.told)
    for _ in range(100):
        actor.on_recommendation(advice())
    assert len(actor.told) == told


def test_late_advice_after_a_snapshot_is_known_again():
    actor = Learner(ROW, seed=0)
    actor.on_world(HERE)
    actor.observe(state())
    actor.go_without_advice()
    facts, arrays = actor.state()
    actor.told.clear()
    actor.on_recommendation(advice(action=3))
    back = Learner(ROW, seed=0)
    back.restore(json.loads(json.dumps(facts)), arrays, actor.told)
    assert back.advice_heard().tolist() == actor.advice_heard().tolist()
    assert back.advice_heard()[0] == 3
