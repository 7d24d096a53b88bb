# SPDX-License-Identifier: Apache-2.0
"""The advice of several mentors: what is complete, who is absent, and what is saved."""

import numpy as np
from room_messages import advice, state
from tiny_worlds import room

from comply_ros.learner.agent import no_advice
from comply_ros.protocol.mentor_advice import MentorAdvice
from comply_ros.protocol.messages import step_id
from comply_ros.world.grid import RIGHT, UP

ROOM, RUN = room(), 7


def advice_after(*observations, names=('anna', 'bob')):
    """Return the advice of mentors after these observations."""
    found = MentorAdvice(names, RUN)
    for msg in observations:
        assert found.add_observation(step_id(msg), msg.state) == []
    return found


def test_advice_is_complete_once_each_mentor_has_given_some():
    found = advice_after(state())
    assert found.complete_advice(0, None) is None
    assert found.add_advice(1, advice(action=RIGHT), ROOM) == (True, ())
    assert found.complete_advice(0, None) is None
    assert found.available_advice(0, None) == [None, RIGHT]
    found.add_advice(0, advice(action=-1), ROOM)
    assert found.complete_advice(0, None) == (-1, RIGHT)
    assert found.complete_advice(1, None) is None  # another state


def test_without_memory_advice_of_an_earlier_visit_is_not_complete():
    found = advice_after(state(), state(step=1, s=1), state(step=2))
    for m in (0, 1):
        found.add_advice(m, advice(action=UP), ROOM)
    assert found.complete_advice(0, None) == (UP, UP)
    assert found.complete_advice(0, (1, 2)) is None
    found.add_advice(0, advice(step=2, action=UP), ROOM)
    assert found.available_advice(0, (1, 2)) == [UP, None]


def test_new_advice_takes_the_place_of_what_was_complete():
    found = advice_after(state(), state(step=1))
    for m in (0, 1):
        found.add_advice(m, advice(action=UP), ROOM)
    assert found.complete_advice(0, None) == (UP, UP)
    found.add_advice(1, advice(step=1, action=RIGHT), ROOM)
    assert found.complete_advice(0, None) == (UP, RIGHT)
    found.restore_advice(0, advice(step=1, action=RIGHT))
    assert found.complete_advice(0, None) == (RIGHT, RIGHT)
    found.forget()
    assert found.complete_advice(0, None) is None


def test_one_that_is_absent_is_heard_by_the_same_advice_as_before():
    found = advice_after(state(), state(step=1))
    for m in (0, 1):
        found.add_advice(m, advice(), ROOM)
    found.absent.add(1)
    assert found.add_same_advice(0, advice(step=1))
    assert not found.add_same_advice(1, advice(step=1))
    assert found.add_advice(1, advice(step=1), ROOM) == (True, ())
    assert found.absent == set()


def test_one_that_is_absent_is_not_missed_until_it_is_heard():
    found = advice_after(state(), state(step=1, s=1))
    found.absent.add(1)
    found.add_advice(0, advice(), ROOM)
    assert found.complete_advice(0, None) == (UP, -1)
    found.add_advice(1, advice(step=1, s=1), ROOM)
    assert found.absent == set()
    assert found.complete_advice(0, None) is None


def test_advice_that_comes_early_is_given_back_with_the_place_of_its_mentor():
    found = advice_after(state(), names=('anna', 'bob', 'carl'))
    for m in (2, 0):
        assert found.add_advice(m, advice(step=1, s=1), ROOM) == (False, ())
    assert found.add_observation((1, 1), 1) == [
        (0, advice(step=1, s=1)), (2, advice(step=1, s=1))]
    assert found.add_observation((1, 2), 2) == []


def test_a_mentor_that_joins_has_given_no_advice_yet():
    found = advice_after(state())
    for m in (0, 1):
        found.add_advice(m, advice(), ROOM)
    found.add_mentor('carl')
    assert found.names == ('anna', 'bob', 'carl') and found.silence == (-1, -1, -1)
    assert found.complete_advice(0, None) is None
    found.add_observation((1, 1), 0)
    found.add_advice(2, advice(step=1, action=RIGHT), ROOM)
    assert found.complete_advice(0, None) == (UP, UP, RIGHT)


def test_the_advice_in_all_states_has_rows_for_each_mentor():
    found, before = advice_after(state()), no_advice(ROOM, 2)
    before[[3, 9]] = RIGHT
    found.add_advice(1, advice(), ROOM)
    expected = np.full(18, -1)
    expected[[3, 9]] = RIGHT, UP  # the newest one of the second, and what the first gave before
    assert found.advice(before).tolist() == expected.tolist()
    assert found.advice(before).dtype == before.dtype


def test_advice_of_all_is_restored_from_its_arrays():
    before, after = advice_after(state(), state(step=1, s=1)), MentorAdvice(
        ('anna', 'bob'), RUN, (1, 1))
    before.add_advice(0, advice(), ROOM)
    before.add_advice(1, advice(action=RIGHT), ROOM)
    before.add_advice(1, advice(step=1, s=1, action=-1), ROOM)
    arrays = before.arrays()
    assert 'advice' in arrays and len(arrays) == 2  # that of the first as where there is one
    after.load_arrays(arrays)
    assert after.newest_advice(0, 0) == advice()
    assert after.newest_advice(1, 0) == advice(action=RIGHT)
    assert after.newest_advice(0, 1) is None
    assert after.newest_advice(1, 1) == advice(step=1, s=1, action=-1)
    before.forget()
    assert before.available_advice(0, None) == [None, None]
