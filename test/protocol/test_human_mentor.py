# SPDX-License-Identifier: Apache-2.0
"""A person as the mentor: messages and edits in every order, on the state machine, without ROS."""

from itertools import permutations
import re

import numpy as np
import pytest
from tiny_worlds import grid

from comply_ros.mentor.mentor_policies import noisy_policy, spoiled_policy
from comply_ros.mentor.policy_text import PolicyError
from comply_ros.protocol.human_mentor import HumanMentor
from comply_ros.protocol.messages import (
    Ignored,
    Notice,
    Recommendation,
    StateReward,
)
from comply_ros.protocol.run_tracker import RIVAL_MESSAGES, WORLD_SILENT
from comply_ros.protocol.world_description import describe_world
from comply_ros.world.grid import LEFT, NO_ACTION, RIGHT, UP
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

ROOM = grid('..G', '.#.', '...')  # state 4 is the obstacle, 8 the goal
ROOM_MSG = describe_world(ROOM, 'room', 7)


def state(step=0, s=0, episode=1, run=7):
    """Return a `StateReward`."""
    return StateReward(run, episode, step, s, -1.0 if step else 0.0, s == 8, False)


def advice(action, step=0, s=0, episode=1):
    """Return a `Recommendation` as the only output."""
    return (Recommendation(7, episode, step, s, action),)


def make_mentor(steering=False):
    """Return a human mentor in the room."""
    mentor = HumanMentor()
    mentor.on_world(ROOM_MSG)
    mentor.set_steering(steering)
    return mentor


@pytest.mark.parametrize('order', list(permutations(('world', 'state', 'edit', 'steer'))))
def test_an_observation_is_answered_in_any_order_and_only_once(order):
    mentor, answers = HumanMentor(), []
    events = {'world': lambda: mentor.on_world(ROOM_MSG)[1:],
              'state': lambda: mentor.observe(state()),
              'edit': lambda: mentor.edit({0: UP}) or (),
              'steer': lambda: mentor.set_steering(True)}
    for event in order:
        if event == 'edit' and mentor.world is None:
            with pytest.raises(PolicyError, match='none is known yet'):
                mentor.edit({0: UP})
        else:
            answers += events[event]()
    answers += mentor.steer(RIGHT)
    assert len(answers) == 1
    observed = max(order.index('world'), order.index('state'))
    edited = order.index('world') < order.index('edit') < observed
    expected = RIGHT if order.index('steer') < observed else UP if edited else NO_ACTION
    assert answers == [*advice(expected)]
    assert mentor.observe(state()) == tuple(answers)


def test_without_edits_there_is_no_advice_and_an_edit_counts_from_the_next_observation_on():
    mentor = make_mentor()
    assert mentor.current_policy.dtype == np.int8 and (mentor.current_policy == NO_ACTION).all()
    assert mentor.observe(state()) == advice(NO_ACTION)
    mentor.edit({0: UP, 1: RIGHT})
    assert mentor.observe(state()) == advice(NO_ACTION)  # a repeated observation
    assert mentor.observe(state(1, 1)) == advice(RIGHT, 1, 1)
    mentor.edit({1: NO_ACTION})
    assert mentor.observe(state(2, 0)) == advice(UP, 2, 0)
    assert mentor.current_policy.tolist() == mentor.policy == [UP] + 8 * [NO_ACTION]
    assert mentor.advice(0) == UP
    assert mentor.step_count == 3


@pytest.mark.parametrize('cells, sentence', [
    ({0: LEFT}, r"an action must not leave the grid, got '<' in .*row 3, column 1\)?"),
    ({0: 4}, 'an action must be 0 left, 1 right, 2 down, 3 up, or -1 for no advice, got 4.*'),
    ({0: 1.0},
     r'an action must be 0 left, 1 right, 2 down, 3 up, or -1 for no advice, got 1\.0.*'),
    ({9: LEFT}, r'a state must lie in \[0, 8\], got 9'),
    ({-1: LEFT}, r'a state must lie in \[0, 8\], got -1'),
    ({True: LEFT}, r'a state must lie in \[0, 8\], got True'),
    ({4: UP}, r'a policy has advice in free cells only, .*got .*\b4\b.*'),
    ({8: LEFT}, r'a policy has advice in free cells only, .*got .*\b8\b.*')])
def test_an_edit_that_is_not_possible_is_rejected_with_one_sentence_and_changes_nothing(
        cells, sentence):
    mentor = make_mentor()
    mentor.edit({1: RIGHT})
    before = mentor.current_policy
    with pytest.raises(PolicyError) as error:
        mentor.edit({0: UP, **cells})
    assert re.fullmatch(sentence, str(error.value))
    assert mentor.current_policy is before
    with pytest.raises(ValueError, match='read-only'):
        mentor.current_policy[0] = 1


def test_a_whole_policy_replaces_the_edited_one():
    mentor, policy = make_mentor(), optimal_policy(World(ROOM))
    mentor.replace(policy)
    assert (mentor.current_policy == policy).all()
    policy[0] = NO_ACTION  # of the caller: the mentor has its own
    policy = optimal_policy(World(ROOM))
    with pytest.raises(PolicyError, match=r'must have the 9 states .* shape \(3,\)'):
        mentor.replace(policy[:3])
    with pytest.raises(PolicyError, match='must be 0 left'):
        mentor.replace(policy.astype(int) * 5)
    assert (mentor.current_policy == policy).all()
    with pytest.raises(PolicyError, match='none is known yet'):
        HumanMentor().replace(policy)


def test_while_steering_an_observation_waits_and_the_answer_becomes_part_of_the_policy():
    mentor = make_mentor(steering=True)
    assert mentor.observe(state()) == ()
    assert mentor.observe(state()) == ()
    assert mentor.waiting == state()
    with pytest.raises(PolicyError, match='must not leave the grid'):
        mentor.steer(LEFT)
    assert mentor.steer(UP) == advice(UP)
    assert mentor.observe(state()) == advice(UP)
    assert (mentor.waiting, mentor.current_policy[0]) == (None, UP)
    assert mentor.steer(RIGHT) == ()  # no observation waits
    assert mentor.current_policy[0] == UP


def test_giving_up_recommends_nothing_and_leaves_the_policy():
    mentor = make_mentor(steering=True)
    mentor.edit({0: UP})
    mentor.observe(state())
    assert mentor.give_up() == advice(NO_ACTION)
    assert mentor.give_up() == ()
    assert mentor.current_policy[0] == UP


def test_at_the_end_of_steering_the_policy_answers():
    mentor = make_mentor(steering=True)
    mentor.edit({0: UP})
    mentor.observe(state())
    assert mentor.set_steering(False) == advice(UP)
    assert mentor.observe(state(1, 3)) == advice(NO_ACTION, 1, 3)


def test_a_robot_that_continues_without_advice_waits_in_its_new_state():
    mentor = make_mentor(steering=True)
    mentor.observe(state())
    assert mentor.observe(state(1, 3)) == ()
    assert mentor.observe(state()) == ()
    assert mentor.waiting == mentor.robot == state(1, 3)
    mentor.observe(state(2, 8))  # the goal: no advice is needed there
    assert (mentor.waiting, mentor.robot) == (None, state(2, 8))
    assert mentor.steer(UP) == ()


def test_an_older_observation_is_ignored():
    mentor = make_mentor()
    mentor.observe(state(2, 1))
    ignored, = mentor.observe(state(1, 0))
    assert type(ignored) is Ignored and ignored.kind == 'state too late'


def test_an_observation_that_cannot_be_right_is_rejected_and_is_not_where_the_robot_is():
    mentor = make_mentor(steering=True)
    rejected, = mentor.observe(state(1, 77))
    assert rejected.kind == 'state outside the world'
    assert (mentor.robot, mentor.waiting) == (None, None)


def test_the_policy_stays_after_a_reset():
    mentor = make_mentor(steering=True)
    mentor.edit({0: UP})
    mentor.observe(state())
    mentor.on_world(ROOM_MSG._replace(run=8, replaces=7))
    assert (mentor.waiting, mentor.robot, mentor.current_policy[0]) == (None, None, UP)
    mentor.observe(state(run=8))
    assert mentor.steer(RIGHT)[0].run == 8


def test_another_map_starts_without_advice_and_answers_what_was_held():
    mentor = HumanMentor()
    mentor.on_world(describe_world(grid('..G'), 'other', 6))
    mentor.edit({0: RIGHT})
    mentor.on_world(ROOM_MSG)
    assert len(mentor.current_policy) == 3  # the first world is followed while it is not silent
    for _ in range(RIVAL_MESSAGES):
        assert mentor.observe(state()) == ()
    outputs = [msg for _ in range(WORLD_SILENT) for msg in mentor.tick()]
    assert outputs == [Notice("follows world 'room', run 7"), *advice(NO_ACTION)]
    assert (mentor.current_policy == NO_ACTION).all() and len(mentor.current_policy) == 9


def test_a_share_of_a_policy_is_spoiled_and_the_rest_is_not():
    world = World(ROOM)
    policy = np.full(9, NO_ACTION, dtype=np.int8)
    generator = np.random.Generator(np.random.PCG64(0))
    assert (spoiled_policy(policy, world, 0.0, generator) == policy).all()
    spoiled = spoiled_policy(policy, world, 1.0, generator)
    assert ((spoiled >= 0) == world.free).all()
    assert (noisy_policy(world, 0.5, np.random.Generator(np.random.PCG64(3))) == spoiled_policy(
        optimal_policy(world), world, 0.5, np.random.Generator(np.random.PCG64(3)))).all()
