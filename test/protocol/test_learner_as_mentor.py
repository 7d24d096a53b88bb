# SPDX-License-Identifier: Apache-2.0
"""A mentor that follows another learner: messages in every order, its death, and other worlds."""

from array import array
from itertools import permutations

import pytest
from tiny_worlds import grid

from comply_ros.protocol.learner_as_mentor import LearnerMentor
from comply_ros.protocol.messages import Notice, Policy, Recommendation, Rejected, StateReward
from comply_ros.protocol.world_description import describe_world
from comply_ros.world.grid import NO_ACTION, RIGHT

CORRIDOR = grid('..G')
OWN, OTHER = (describe_world(CORRIDOR, name, run) for name, run in (('corridor', 7), ('hall', 3)))
ROOM = describe_world(grid('..G', '...'), 'room', 4)
FOLLOWS = Notice('advises by the policy of the learner /other')
WAITS = 'a policy of the learner /other: does it run, in the same world as this mentor?'


def policy(*actions, run=3):
    """Return a `Policy` of the other learner."""
    return Policy(run, array('h', actions))


def state(step, s=0):
    """Return a `StateReward`."""
    return StateReward(7, 1, step, s, -1.0 if step else 0.0, False, False)


def action_in(mentor, step, s=0):
    """Return the action that a mentor recommends in a state of its own world."""
    msg, = mentor.observe(state(step, s))
    assert msg == Recommendation(7, 1, step, s, msg.action, '')
    return msg.action


def following():
    """Return a mentor that has received a policy of the other learner."""
    mentor = LearnerMentor('/other')
    mentor.on_world(OWN)
    mentor.on_learner_world(OTHER)
    assert mentor.on_learner_policy(policy(RIGHT, NO_ACTION, NO_ACTION)) == (FOLLOWS,)
    return mentor


@pytest.mark.parametrize('order', list(permutations(('own', 'world', 'policy'))))
def test_worlds_and_policy_are_received_in_any_order(order):
    mentor, outputs = LearnerMentor('/other'), []
    events = {'own': lambda: mentor.on_world(OWN),
              'world': lambda: mentor.on_learner_world(OTHER),
              'policy': lambda: mentor.on_learner_policy(policy(RIGHT, NO_ACTION, NO_ACTION))}
    for event in order:
        assert FOLLOWS not in outputs
        outputs += events[event]()
    assert outputs[-1] == FOLLOWS
    assert mentor.policy == [RIGHT, NO_ACTION, NO_ACTION]


def test_it_answers_at_once_without_advice_until_there_is_a_policy_and_where_that_has_none():
    mentor = LearnerMentor('/other')
    mentor.on_world(OWN)
    assert action_in(mentor, 0) == NO_ACTION
    assert mentor.waiting_for() == WAITS
    mentor.on_learner_world(OTHER)
    mentor.on_learner_policy(policy(RIGHT, NO_ACTION, NO_ACTION))
    assert action_in(mentor, 0) == NO_ACTION  # a repeated observation
    assert action_in(mentor, 1) == RIGHT
    assert action_in(mentor, 2, 1) == NO_ACTION
    assert mentor.waiting_for() is None


def test_a_newer_policy_counts_from_the_next_observation_on():
    mentor = following()
    assert action_in(mentor, 0) == RIGHT
    assert mentor.on_learner_policy(policy(NO_ACTION, RIGHT, NO_ACTION)) == ()
    assert action_in(mentor, 0) == RIGHT
    assert action_in(mentor, 1) == NO_ACTION
    assert action_in(mentor, 2, 1) == RIGHT


def test_where_the_other_learner_dies_its_last_policy_counts_until_it_is_back():
    mentor = following()
    for _ in range(10):  # seconds without a message of it
        mentor.tick()
        mentor.observe(state(0))
    assert action_in(mentor, 1) == RIGHT
    mentor.on_learner_world(OTHER._replace(run=5))  # it is back with its world, in another run
    mentor.on_learner_policy(policy(NO_ACTION, NO_ACTION, NO_ACTION))  # of the run before
    assert action_in(mentor, 2) == RIGHT
    mentor.on_learner_policy(policy(NO_ACTION, RIGHT, NO_ACTION, run=5))
    assert action_in(mentor, 3) == NO_ACTION
    assert action_in(mentor, 4, 1) == RIGHT


def test_a_learner_in_another_world_is_rejected_in_one_sentence_and_not_followed():
    mentor = following()
    rejected, = mentor.on_learner_world(ROOM)
    assert rejected == Rejected(
        'world of the other learner', "the learner /other must be in the world of this mentor, "
        f"'corridor' (hash {OWN.sha256[:12]!r}), got 'room' (hash {ROOM.sha256[:12]!r})")
    assert action_in(mentor, 0) == NO_ACTION
    assert mentor.on_learner_policy(policy(*6 * [RIGHT], run=4)) == (rejected,)
    assert mentor.waiting_for() == WAITS
    mentor.on_learner_world(OTHER._replace(run=5))
    assert mentor.on_learner_policy(policy(RIGHT, -1, -1, run=5)) == (FOLLOWS,)
    assert action_in(mentor, 1) == RIGHT


@pytest.mark.parametrize('actions, sentence', [
    ((RIGHT, RIGHT), 'a policy must have the 3 states of the map, got an array of shape (2,)'),
    ((RIGHT, 9, -1), 'an action must be 0 left, 1 right, 2 down, 3 up, or -1 for no advice, '
     'got 9')])
def test_a_policy_that_cannot_be_is_rejected_and_the_one_before_stays(actions, sentence):
    mentor = following()
    rejected, = mentor.on_learner_policy(policy(*actions))
    assert type(rejected) is Rejected and rejected.reason.startswith(sentence)
    assert action_in(mentor, 0) == RIGHT


def test_actions_in_states_where_nobody_acts_are_left_out():
    mentor = following()
    mentor.on_learner_policy(policy(RIGHT, RIGHT, RIGHT))  # the last state is the goal
    assert mentor.policy == [RIGHT, RIGHT, NO_ACTION]


def test_in_another_run_of_its_world_it_follows_on_and_in_another_world_it_waits():
    mentor = following()
    mentor.on_world(OWN._replace(run=8, replaces=7))
    assert mentor.policy == [RIGHT, NO_ACTION, NO_ACTION]
    assert mentor.waiting_for() is None


def test_a_share_of_the_states_is_the_same_at_every_policy():
    mentor = LearnerMentor('/other', 0.5, seed=1)
    mentor.on_world(OWN)
    mentor.on_learner_world(OTHER)
    mentor.on_learner_policy(policy(RIGHT, RIGHT, NO_ACTION))
    first = mentor.policy
    assert sorted(first) == [NO_ACTION, NO_ACTION, RIGHT]  # one of the two free cells
    mentor.on_learner_policy(policy(RIGHT, RIGHT, NO_ACTION))
    assert mentor.policy == first
