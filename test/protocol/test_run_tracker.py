# SPDX-License-Identifier: Apache-2.0
"""Which world is followed where there are several, and which observation may come next."""

from itertools import permutations, product

import pytest
from room_messages import ROOM, ROOM_MSG, state
from tiny_worlds import grid

from comply_ros.protocol.messages import Ignored, Inactive, Notice, Rejected
from comply_ros.protocol.run_tracker import (
    OWNED_BY_OTHER,
    RIVAL_MESSAGES,
    RIVALS,
    RunTracker,
    WORLD_GONE,
    WORLD_SILENT,
)
from comply_ros.protocol.world_description import describe_world

FIRST, SECOND = (ROOM_MSG._replace(run=run, began=10.0 * run) for run in (1, 2))


def handler(msg):
    """Return a held message as an output."""
    return (msg,)


def make_tracker(**settings):
    """Return a tracker whose output for a new run is its number, and whether that is a reset."""
    tracker = RunTracker(lambda is_reset: (Notice(f'{tracker.run} {is_reset}'),), **settings)
    return tracker


def following_first():
    """Return a tracker that follows the first world."""
    tracker = make_tracker()
    assert tracker.on_world(FIRST) == (Notice('1 False'),)
    return tracker


def publish(tracker, run, count):
    """Have another world publish some states, which the tracker holds."""
    for _ in range(count):
        tracker.hold(handler, state(run=run), 'a state')


def follows_when_silent(tracker, run):
    """Tell whether the tracker turns to a run when the world that it follows is silent."""
    for _ in range(WORLD_SILENT):
        tracker.tick()
    return tracker.run == run


def test_before_the_first_world_there_is_none():
    tracker = make_tracker()
    assert (tracker.description, tracker.world, tracker.run) == (None, None, None)
    assert tracker.waiting_for() == 'a world: is a grid_world running?'


@pytest.mark.parametrize('answered', [False, True])
@pytest.mark.parametrize('began', [-1e300, -10.0, 0.0, 10.0, 20.0, 1e300])
@pytest.mark.parametrize('run', [0, 2, 2 ** 32 - 1])
def test_the_first_world_is_followed_and_a_second_is_not_whenever_it_began(answered, began, run):
    tracker = following_first()
    if answered:
        tracker.answer(state(run=1))
    assert tracker.on_world(ROOM_MSG._replace(run=run, began=began)) == ()
    assert tracker.run == 1 and tracker.world.grid == ROOM


@pytest.mark.parametrize('order', list(permutations((1, 2, 3))))
@pytest.mark.parametrize('began', [(1.0, 2.0, 3.0), (3.0, 2.0, 1.0), (0.0, 0.0, 0.0)])
def test_of_several_worlds_the_first_that_is_received_is_followed(order, began):
    tracker = make_tracker()
    for run in order:
        tracker.on_world(ROOM_MSG._replace(run=run, began=began[run - 1]))
    assert tracker.run == order[0]


@pytest.mark.parametrize('answered', [False, True])
@pytest.mark.parametrize('messages, ticks, run', [
    (RIVAL_MESSAGES, WORLD_SILENT, 2), (RIVAL_MESSAGES - 1, WORLD_SILENT, 1),
    (RIVAL_MESSAGES, WORLD_SILENT - 1, 1)])
def test_another_world_is_followed_when_it_publishes_and_this_one_is_silent(
        answered, messages, ticks, run):
    tracker = following_first()
    if answered:
        tracker.answer(state(run=1))
    tracker.on_world(SECOND)
    publish(tracker, 2, messages)
    outputs = [msg for _ in range(ticks) for msg in tracker.tick()]
    assert tracker.run == run
    assert outputs == ([Notice('2 False'), state(run=2)] if run == 2 else [])


def test_a_world_that_publishes_its_description_is_not_silent():
    tracker = following_first()
    tracker.on_world(SECOND)
    publish(tracker, 2, RIVAL_MESSAGES)
    for _ in range(3 * WORLD_SILENT):
        tracker.tick()
        assert tracker.on_world(FIRST) == ()
    assert tracker.run == 1


def test_a_world_without_a_description_is_never_followed():
    tracker = following_first()
    for _ in range(10):
        publish(tracker, 2, 1)
        assert tracker.tick() == ()
    assert tracker.run == 1


def test_a_world_after_a_reset_is_followed_at_once():
    tracker = following_first()
    tracker.answer(state(run=1))
    assert tracker.on_world(SECOND._replace(replaces=1)) == (Notice('2 True'),)
    assert tracker.run == 2 and not tracker.world_changed
    assert tracker.answered == (0, -1) and tracker.expected is None


@pytest.mark.parametrize('other', [
    SECOND, SECOND._replace(replaces=3),
    describe_world(grid('..G', '...'), 'other', 2)._replace(replaces=1)])
def test_another_world_than_the_one_after_a_reset_is_not_followed(other):
    tracker = following_first()
    assert tracker.on_world(other) == ()
    assert tracker.run == 1


def test_the_description_of_a_run_before_a_reset_comes_late_and_changes_nothing():
    tracker = following_first()
    tracker.on_world(SECOND._replace(replaces=1))
    assert tracker.on_world(FIRST) == ()
    ignored, = tracker.hold(handler, state(run=1), 'a state')
    assert ignored == Ignored('before a reset', 'ignored a state of run 1, which ended with a '
                              'reset of its world')
    publish(tracker, 1, RIVAL_MESSAGES)
    assert not follows_when_silent(tracker, 1)


@pytest.mark.parametrize('changed', [False, True])
def test_a_new_run_says_whether_its_world_is_another_one(changed):
    tracker = following_first()
    assert tracker.world_changed
    before = tracker.world
    tracker.on_world(describe_world(grid('..G'), 'other', 2) if changed else SECOND)
    publish(tracker, 2, RIVAL_MESSAGES)
    assert follows_when_silent(tracker, 2)
    assert tracker.world_changed == changed
    assert (tracker.world is before) != changed


def test_messages_of_an_unknown_run_are_received_when_their_world_comes():
    tracker = make_tracker()
    assert tracker.hold(handler, state(run=1), 'a state') == ()
    assert tracker.on_world(FIRST) == (Notice('1 False'), state(run=1))
    assert tracker.continues() == ()  # nothing is held any more


def test_held_messages_are_rejected_when_this_world_continues():
    tracker = following_first()
    tracker.on_world(SECOND)
    publish(tracker, 2, RIVAL_MESSAGES)
    rejected, = tracker.continues()
    assert rejected == Rejected('another run', 'a state must belong to run 1 of the world here, '
                                'got run 2')
    assert not follows_when_silent(tracker, 2)  # and they do not count any more


def test_a_held_message_is_rejected_when_one_of_a_third_run_replaces_it():
    tracker = following_first()
    assert tracker.hold(handler, state(run=2), 'a state') == ()
    assert tracker.hold(handler, state(run=2), 'a state') == ()
    rejected, = tracker.hold(handler, state(run=3), 'a state')
    assert rejected.reason.endswith('got run 2')


def tracker_with_many_rivals():
    """Return a tracker that received more other worlds than it remembers."""
    tracker = following_first()
    for run in range(2, 3 * RIVALS):
        tracker.on_world(ROOM_MSG._replace(run=run))
    return tracker


def test_a_tracker_remembers_the_last_few_of_many_worlds():
    remembered = []
    for run in range(2, 3 * RIVALS):
        tracker = tracker_with_many_rivals()
        publish(tracker, run, RIVAL_MESSAGES)
        if follows_when_silent(tracker, run):
            remembered.append(run)
    assert remembered == list(range(2 * RIVALS, 3 * RIVALS))


def test_the_messages_of_a_world_that_was_forgotten_do_not_count():
    tracker = following_first()
    tracker.on_world(SECOND)
    publish(tracker, 2, RIVAL_MESSAGES)
    for run in range(3, 3 * RIVALS):
        tracker.on_world(ROOM_MSG._replace(run=run))
    tracker.on_world(SECOND)
    assert not follows_when_silent(tracker, 2)


def test_it_says_when_the_world_has_been_silent_for_long():
    tracker = following_first()
    for _ in range(WORLD_GONE):
        assert tracker.waiting_for() is None
        tracker.tick()
    assert tracker.waiting_for() == ("the next state of world 'room': is its grid_world running, "
                                     'and not paused?')
    tracker.continues()
    assert tracker.waiting_for() is None


def after(*answered, **settings):
    """Return a tracker that has answered these observations of the room."""
    tracker = make_tracker(**settings)
    tracker.on_world(ROOM_MSG)
    for msg in answered:
        tracker.answer(msg)
    return tracker


def test_the_first_observation_is_accepted_at_once_and_any_other_first_one_when_repeated():
    assert after().check_order(state()) is None
    tracker, late = after(), state(episode=9, step=3, s=4)
    assert tracker.check_order(late).kind == 'joins late'
    assert tracker.check_order(state(episode=9, step=4, s=4)).kind == 'joins late'
    assert tracker.check_order(late).kind == 'joins late'
    assert tracker.check_order(late) is None


@pytest.mark.parametrize('msg', [state(step=1, s=1), state(step=1, s=3)])
def test_the_next_observation_is_one_move_away(msg):
    assert after(state()).check_order(msg) is None


@pytest.mark.parametrize('msg', [
    state(), state(step=3, s=1), state(episode=2), state(episode=2, step=1, s=1),
    state(episode=4_000_000_000)])
def test_any_other_step_id_is_rejected_however_often_it_is_repeated(msg):
    tracker = after(state(step=0), state(step=1, s=1))
    for _ in range(5):
        rejected = tracker.check_order(msg)
        assert (type(rejected), rejected.kind) == (Rejected, 'step id out of order')
        tracker.tick()


def test_after_the_end_of_an_episode_comes_the_next_episode_and_nothing_else():
    tracker = after(state(step=1, s=8, terminated=True))
    assert tracker.check_order(state(step=2, s=7)).kind == 'step id out of order'
    assert tracker.check_order(state(episode=2)) is None


def test_where_ends_of_episodes_are_not_published_the_next_episode_may_come_at_any_time():
    assert after(state(), sees_episode_ends=False).check_order(state(episode=2)) is None
    assert after(state(), sees_episode_ends=False).check_order(state(episode=3)) is not None


def test_a_jump_is_accepted_when_it_is_repeated_and_nothing_came_between():
    tracker = after(state())
    jump, move = state(step=1, s=8), state(step=1, s=1)
    assert tracker.check_order(jump).reason == (
        'a state must be one move from the last one, 0, got 8: does this world move as it is '
        'described?')
    assert tracker.check_order(move) is None  # the true observation
    assert tracker.check_order(jump).kind == 'state out of reach'
    assert tracker.check_order(jump) is None  # a world that moves otherwise


def test_two_different_jumps_are_not_one_that_is_repeated():
    tracker = after(state())
    for _ in range(3):
        for s in (8, 7, 5):
            assert tracker.check_order(state(step=1, s=s)).kind == 'state out of reach'


def test_a_gap_is_accepted_only_where_it_is_allowed_and_only_after_a_tick():
    tracker = after(state())
    tracker.allow_gap()
    late = state(step=7, s=4)
    for _ in range(3):
        assert tracker.check_order(late).kind == 'step id out of order'
    tracker.tick()
    notice = tracker.check_order(late)
    assert notice == Notice('continues at step id (1, 7) after (1, 0): what lay between was not '
                            'received, or its journal has lost it')
    tracker.answer(late)
    assert tracker.check_order(state(step=20, s=4)).kind == 'step id out of order'


def test_the_next_observation_shows_that_nothing_is_missing():
    tracker = after(state())
    tracker.allow_gap()
    assert tracker.check_order(state(step=1, s=1)) is None
    assert not tracker.gap_allowed


def test_a_second_learner_becomes_inactive_after_many_observations_for_another():
    tracker = after()
    for step in range(OWNED_BY_OTHER - 1):
        for _ in range(3):  # repetitions do not count
            assert tracker.leave_to_other(state(step=step)._replace(learner=5), 6) == ()
    inactive, = tracker.leave_to_other(state(step=OWNED_BY_OTHER)._replace(learner=5), 6)
    assert inactive == Inactive('learner 5 came first and owns run 7: stop this learner, 6, or '
                                'give it a world of its own')
    assert tracker.inactive


def test_observations_for_another_learner_that_do_not_follow_each_other_count_as_one():
    tracker = after()
    for episode, step in product((9, 3, 6), range(OWNED_BY_OTHER - 1)):
        tracker.leave_to_other(state(episode=episode, step=step)._replace(learner=5), 6)
        assert not tracker.inactive
        assert tracker.left_to_others == step + 1


def test_an_answer_of_its_own_ends_the_count_of_observations_for_another():
    tracker = after()
    for step in range(OWNED_BY_OTHER - 1):
        tracker.leave_to_other(state(step=step)._replace(learner=5), 6)
    tracker.answer(state(step=OWNED_BY_OTHER))
    assert tracker.leave_to_other(state(step=OWNED_BY_OTHER + 1)._replace(learner=5), 6) == ()


def test_the_usual_next_step_is_expected_until_something_else_happens():
    tracker = after(state())
    assert tracker.expected == (7, 1, 1)
    assert tracker.is_usual_step(state(step=1, s=1, reward=-1.0))
    for msg in (state(step=1, s=4), state(step=1, s=-1), state(step=1, s=99),
                state(step=1, s=1, terminated=True), state(step=1, s=1, truncated=True),
                state(step=1, s=1, reward=float('nan'))):
        assert not tracker.is_usual_step(msg)
    for happens in (lambda: tracker.allow_gap(), lambda: tracker.too_late((0, 0)),
                    lambda: tracker.hold(handler, state(run=5), 'a state'),
                    lambda: tracker.check_order(state(step=5)),
                    lambda: tracker.leave_to_other(state(step=1)._replace(learner=5), 6)):
        tracker = after(state())
        happens()
        assert tracker.expected is None


@pytest.mark.parametrize('end', [{'terminated': True}, {'truncated': True}])
def test_after_the_end_of_an_episode_no_usual_step_is_expected(end):
    assert after(state(step=1, s=8, **end)).expected is None


def test_a_tracker_that_is_restored_allows_a_gap():
    before, tracker = after(state(), state(step=1, s=1)), after()
    tracker.load_state_dict(before.state_dict())
    assert (tracker.answered, tracker.answered_state) == ((1, 1), 1)
    assert tracker.gap_allowed and tracker.expected is None
    assert tracker.check_order(state(step=2, s=2)) is None
