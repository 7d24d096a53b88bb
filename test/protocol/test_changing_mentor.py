# SPDX-License-Identifier: Apache-2.0
"""A mentor whose policy changes while it is used: when a change counts, and what cannot be one."""

import pytest
from tiny_worlds import grid

from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.protocol.changing_mentor import ChangingMentor
from comply_ros.protocol.messages import Ignored, Recommendation, StateReward
from comply_ros.protocol.world_description import describe_world
from comply_ros.world.grid import NO_ACTION, RIGHT

CORRIDOR = describe_world(grid('..G'), 'corridor', 7)


def state(step, s=0, run=7):
    """Return a `StateReward`."""
    return StateReward(run, 1, step, s, -1.0 if step else 0.0, False, False)


def advice(action, step, s=0):
    """Return a `Recommendation` as the only output."""
    return (Recommendation(7, 1, step, s, action, 'anna'),)


def make_mentor():
    """Return a mentor in the corridor."""
    mentor = ChangingMentor('anna')
    mentor.on_world(CORRIDOR)
    return mentor


def test_a_change_counts_from_the_next_observation_on_and_a_repeated_one_keeps_its_answer():
    mentor = make_mentor()
    assert mentor.observe(state(0)) == advice(NO_ACTION, 0)
    mentor.replace([RIGHT, RIGHT, NO_ACTION])
    assert mentor.observe(state(0)) == advice(NO_ACTION, 0)
    assert mentor.observe(state(1, 1)) == advice(RIGHT, 1, 1)
    assert type(mentor.observe(state(0))[0]) is Ignored  # it comes late
    assert mentor.step_count == 2


def test_a_policy_stays_in_another_run_of_the_same_world_and_goes_with_the_world():
    mentor = make_mentor()
    mentor.replace([RIGHT, NO_ACTION, NO_ACTION])
    mentor.on_world(CORRIDOR._replace(run=8, replaces=7))
    assert mentor.current_policy.tolist() == [RIGHT, NO_ACTION, NO_ACTION]
    other = make_mentor()
    other.replace([RIGHT, NO_ACTION, NO_ACTION])
    room = describe_world(grid('..G', '...'), 'room', 9)
    other.on_world(room)
    for number in (1, 2):
        other.tick()
        other.observe(StateReward(9, 1, number - 1, 0, 0.0, False, False))
    other.tick()
    other.tick()
    assert other.current_policy.tolist() == 6 * [NO_ACTION]


def test_what_is_no_policy_of_the_world_changes_nothing():
    mentor = make_mentor()
    before = mentor.current_policy
    with pytest.raises(PolicyError, match='must have the 3 states'):
        mentor.replace([RIGHT])
    assert mentor.current_policy is before
    with pytest.raises(ValueError, match='read-only'):
        before[0] = RIGHT
    with pytest.raises(PolicyError, match='a policy must be for a world, and none is known yet'):
        ChangingMentor().replace([RIGHT])
