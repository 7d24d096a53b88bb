# SPDX-License-Identifier: Apache-2.0
"""Advice counts where it belongs to an observation that was made."""

import numpy as np
import pytest
from room_messages import advice, state
from tiny_worlds import room

from comply_ros.learner.agent import no_advice
from comply_ros.protocol.advice_buffer import AdviceBuffer, REMEMBERED
from comply_ros.protocol.messages import step_id

ROOM, RUN = room(), 7
NOBODY = no_advice(ROOM)


def buffer_after(*observations):
    """Return an advice buffer after these observations."""
    buffer = AdviceBuffer(RUN)
    for msg in observations:
        assert buffer.add_observation(step_id(msg), msg.state) is None
    return buffer


def test_advice_for_an_observation_counts_and_an_older_one_does_not_replace_it():
    buffer = buffer_after(state(), state(step=1, s=1), state(step=2, s=0))
    assert buffer.add_advice(advice(step=2, action=1), ROOM) == (True, ())
    assert buffer.add_advice(advice(step=0, action=3), ROOM) == (False, ())  # late, and older
    assert buffer.newest_advice(0).action == 1
    assert buffer.advice(NOBODY).dtype == np.int8
    assert buffer.advice(NOBODY).tolist() == [1, -1, -1, -1, -1, -1, -1, -1, -1]


def test_the_same_advice_for_a_later_visit_is_remembered_once_more():
    buffer = buffer_after(state(), state(step=1, s=1), state(step=2, s=0))
    assert not buffer.add_same_advice(advice())  # it is the first
    buffer.add_advice(advice(), ROOM)
    assert buffer.add_same_advice(advice(step=2))
    assert buffer.newest_advice(0) == advice(step=2)


@pytest.mark.parametrize('other', [
    advice(), advice(action=1), advice(step=1), advice(step=2, action=1), advice(step=3)])
def test_advice_that_is_not_the_same_for_a_later_visit_changes_nothing(other):
    buffer = buffer_after(state(), state(step=1, s=1), state(step=2, s=0))
    buffer.add_advice(advice(), ROOM)
    assert not buffer.add_same_advice(other)
    assert buffer.newest_advice(0) == advice()


def test_advice_for_another_state_than_the_observed_one_is_rejected():
    buffer = buffer_after(state())
    counts, (rejected,) = buffer.add_advice(advice(s=1), ROOM)
    assert not counts
    assert rejected.reason == 'a recommendation for step id (1, 0) must be for state 0, got 1'
    assert buffer.newest_advice(1) is None


def test_advice_that_comes_before_its_observation_waits_for_it():
    buffer = buffer_after(state())
    assert buffer.add_advice(advice(step=1, s=1), ROOM) == (False, ())
    assert buffer.newest_advice(1) is None
    assert buffer.add_observation((1, 1), 1) == advice(step=1, s=1)
    assert buffer.add_observation((1, 2), 2) is None


def test_advice_without_an_observation_is_rejected_when_other_advice_takes_its_place():
    buffer = buffer_after(state())
    buffer.add_advice(advice(episode=90), ROOM)
    _, (rejected,) = buffer.add_advice(advice(step=1, s=1), ROOM)
    assert rejected.reason == ('a recommendation must be for an observation that was made, got '
                               'step id (90, 0) after (1, 0)')


def test_advice_for_an_observation_long_past_is_ignored():
    buffer = buffer_after(*(state(step=step, s=step % 2) for step in range(2 * REMEMBERED)))
    _, (ignored,) = buffer.add_advice(advice(), ROOM)
    assert ignored.kind == 'advice too late'
    oldest = REMEMBERED  # of those that still count
    assert buffer.add_advice(advice(step=oldest, s=oldest % 2), ROOM) == (True, ())


def test_forgotten_advice_is_gone_and_the_observations_stay():
    buffer = buffer_after(state())
    buffer.add_advice(advice(), ROOM)
    buffer.forget()
    assert buffer.newest_advice(0) is None
    assert buffer.add_advice(advice(), ROOM) == (True, ())


def test_advice_is_restored_from_its_arrays():
    before, after = buffer_after(state(), state(step=1, s=1)), AdviceBuffer(RUN, (1, 1))
    before.add_advice(advice(), ROOM)
    before.add_advice(advice(step=1, s=1, action=-1), ROOM)
    after.load_array(before.array())
    assert after.newest_advice(0) == advice()
    assert after.newest_advice(1) == advice(step=1, s=1, action=-1)
