# SPDX-License-Identifier: Apache-2.0
"""A person as the mentor, in every order, on the actor, without ROS."""

from itertools import permutations

import numpy as np
import pytest
from tiny_worlds import grid

from comply_ros.mentor.mentor_policies import noisy_policy, spoiled_policy
from comply_ros.mentor.policy_text import PolicyError
from comply_ros.protocol.human_mentor import HumanMentor
from comply_ros.protocol.messages import describe_world, Recommendation, StateReward
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

ROOM = grid('..G', '.#.', '...')  # state 4 is the obstacle, 8 the goal
HERE = describe_world(ROOM, 'room', 7)
UP, RIGHT, NONE = 3, 1, -1


def asked(step=0, s=0, episode=1, run=7):
    """Return a `StateReward`."""
    return StateReward(run, episode, step, s, -1.0 if step else 0.0, s == 8, False)


def msg(action, step=0, s=0, episode=1):
    """Return the `Recommendation` as it is said, alone."""
    return (Recommendation(7, episode, step, s, action),)


def person(steering=False):
    """Return a person in the room."""
    actor = HumanMentor()
    actor.on_world(HERE)
    actor.take_the_wheel(steering)
    return actor


@pytest.mark.parametrize('order', list(permutations(('world', 'state', 'paint', 'steer'))))
def test_a_question_is_answered_in_any_order_and_only_once(order):
    actor, answers = HumanMentor(), []
    deeds = {'world': lambda: actor.on_world(HERE)[1:],
             'state': lambda: actor.observe(asked()),
             'paint': lambda: actor.paint({0: UP}) or (),
             'steer': lambda: actor.take_the_wheel(True)}
    for deed in order:
        if deed == 'paint' and actor.world is None:
            with pytest.raises(PolicyError, match='none is known yet'):
                actor.paint({0: UP})
        else:
            answers += deeds[deed]()
    answers += actor.steer(RIGHT)
    assert len(answers) == 1
    steers_in_time = max(order.index('world'), order.index('state')) > order.index('steer')
    painted = order.index('paint') < max(order.index('world'), order.index('state')) \
        and order.index('paint') > order.index('world')
    expected = RIGHT if steers_in_time else UP if painted else NONE
    assert answers == [*msg(expected)]
    assert actor.observe(asked()) == tuple(answers)


def test_a_person_says_nothing_at_first_and_what_is_painted_from_the_next_question_on():
    actor = person()
    assert actor.painted.dtype == np.int8 and (actor.painted == NONE).all()
    assert actor.observe(asked()) == msg(NONE)
    actor.paint({0: UP, 1: RIGHT})
    assert actor.observe(asked()) == msg(NONE)  # the same question, the same answer
    assert actor.observe(asked(1, 1)) == msg(RIGHT, 1, 1)
    actor.paint({1: NONE})
    assert actor.observe(asked(2, 0)) == msg(UP, 2, 0)
    assert actor.painted.tolist() == actor.policy == [UP] + 8 * [NONE]
    assert actor.advice(0) == UP


@pytest.mark.parametrize('cells, sentence', [
    ({0: 0}, "an action must not leave the grid, got '<' in state 0 (row 3, column 1)"),
    ({0: 4}, 'an action must be 0 left, 1 right, 2 down, 3 up, or -1 for no advice, got 4'),
    ({0: 1.0}, 'an action must be 0 left, 1 right, 2 down, 3 up, or -1 for no advice, got 1.0'),
    ({9: 0}, 'a state must lie in [0, 8], got 9'),
    ({-1: 0}, 'a state must lie in [0, 8], got -1'),
    ({True: 0}, 'a state must lie in [0, 8], got True'),
    ({4: UP}, 'a policy has advice in free cells only, got some in state 4 at (1, 1)'),
    ({8: 0}, 'a policy has advice in free cells only, got some in state 8 at (2, 2)')])
def test_what_cannot_be_painted_is_refused_with_one_sentence_and_nothing_changes(cells, sentence):
    actor = person()
    actor.paint({1: RIGHT})
    before = actor.painted
    with pytest.raises(PolicyError) as refused:
        actor.paint({0: UP, **cells})
    assert str(refused.value) == sentence
    assert actor.painted is before
    with pytest.raises(ValueError, match='read-only'):
        actor.painted[0] = 1


def test_a_whole_policy_takes_the_place_of_what_was_painted():
    actor, policy = person(), optimal_policy(World(ROOM))
    actor.replace(policy)
    assert (actor.painted == policy).all()
    with pytest.raises(PolicyError, match=r'must have the 9 states .* shape \(3,\)'):
        actor.replace(policy[:3])
    with pytest.raises(PolicyError, match='must be 0 left'):
        actor.replace(policy.astype(int) * 5)
    assert (actor.painted == policy).all()


def test_while_steering_a_question_waits_for_the_person_and_the_answer_is_painted():
    actor = person(steering=True)
    assert actor.observe(asked()) == ()
    assert actor.observe(asked()) == ()
    assert actor.waiting == asked()
    with pytest.raises(PolicyError, match='must not leave the grid'):
        actor.steer(0)
    assert actor.steer(UP) == msg(UP)
    assert actor.observe(asked()) == msg(UP)
    assert (actor.waiting, actor.painted[0]) == (None, UP)
    assert actor.steer(RIGHT) == ()  # nobody waits
    assert actor.painted[0] == UP


def test_whose_patience_ends_hears_no_advice_and_nothing_is_erased():
    actor = person(steering=True)
    actor.paint({0: UP})
    actor.observe(asked())
    assert actor.give_up() == msg(NONE)
    assert actor.give_up() == ()
    assert actor.painted[0] == UP


def test_who_lets_the_wheel_go_answers_by_what_is_painted():
    actor = person(steering=True)
    actor.paint({0: UP})
    actor.observe(asked())
    assert actor.take_the_wheel(False) == msg(UP)
    assert actor.observe(asked(1, 3)) == msg(NONE, 1, 3)


def test_a_robot_that_goes_on_without_advice_waits_in_its_new_state():
    actor = person(steering=True)
    actor.observe(asked())
    assert actor.observe(asked(1, 3)) == ()
    assert actor.observe(asked()) == ()
    assert actor.waiting == actor.robot == asked(1, 3)
    actor.observe(asked(2, 8))  # the goal: nobody waits there
    assert (actor.waiting, actor.robot) == (None, asked(2, 8))
    assert actor.steer(UP) == ()


def test_an_older_question_is_not_answered_again():
    actor = person()
    actor.observe(asked(2, 1))
    assert actor.observe(asked(1, 0))[0].kind == 'state too late'


def test_a_state_that_cannot_be_is_refused_and_is_not_where_the_robot_is():
    actor = person(steering=True)
    refused, = actor.observe(asked(1, 77))
    assert refused.kind == 'state outside the grid'
    assert (actor.robot, actor.waiting) == (None, None)


def test_what_is_painted_stays_after_a_reset_and_goes_with_the_map():
    actor = person(steering=True)
    actor.paint({0: UP})
    actor.observe(asked())
    actor.on_world(HERE._replace(run=8, replaces=7))
    assert (actor.waiting, actor.robot, actor.painted[0]) == (None, None, UP)
    actor.observe(asked(run=8))
    assert actor.steer(RIGHT)[0].run == 8
    other = HumanMentor()
    other.on_world(describe_world(grid('..G'), 'other', 6)._replace(began=9.0))
    other.paint({0: RIGHT})
    other.on_world(HERE)  # began first
    assert (other.painted == NONE).all() and len(other.painted) == 9


def test_a_share_of_a_policy_is_spoiled_and_the_rest_is_not():
    world = World(ROOM)
    policy = np.full(9, NONE, dtype=np.int8)
    generator = np.random.Generator(np.random.PCG64(0))
    assert (spoiled_policy(policy, world, 0.0, generator) == policy).all()
    spoiled = spoiled_policy(policy, world, 1.0, generator)
    assert ((spoiled >= 0) == world.free).all()
    assert (noisy_policy(world, 0.5, np.random.Generator(np.random.PCG64(3))) == spoiled_policy(
        optimal_policy(world), world, 0.5, np.random.Generator(np.random.PCG64(3)))).all()
