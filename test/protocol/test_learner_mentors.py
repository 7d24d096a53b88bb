# SPDX-License-Identifier: Apache-2.0
"""A learner with several mentors: whom it waits for, who joins, and what it saves."""

from dataclasses import replace
from itertools import permutations
import json

import pytest
from room_messages import advice, CONFIG, follow_instead, ROOM_MSG, RUN, state, types
from tiny_worlds import grid

from comply_ros.mentor.several_mentors import MentorNameError
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.messages import (
    Action,
    AnsweredObservation,
    Ignored,
    Notice,
    OtherAdvice,
    Progress,
    ReceivedAdvice,
    ReceivedOtherAdvice,
    Rejected,
)
from comply_ros.protocol.world_description import describe_world
from comply_ros.world.grid import RIGHT, UP

ANNA, BOB, CARL = range(3)
NAMES = ('anna', 'bob', 'carl')


def make_learner(names=NAMES, remembers_advice=True, **settings):
    """Return a learner that has received the world, and takes the advice of these mentors."""
    learner = Learner(replace(CONFIG, **settings), 0, remembers_advice, mentors=names)
    learner.on_world(ROOM_MSG)
    return learner


def hear(learner, m, **fields):
    """Return the outputs for a recommendation of a mentor."""
    return learner.receivers[m](advice(**fields))


def hear_all(learner, **fields):
    """Return the outputs for the same recommendation of every mentor."""
    return [msg for m in range(len(learner.mentors)) for msg in hear(learner, m, **fields)]


@pytest.mark.parametrize('order', list(permutations(('state', ANNA, BOB, CARL))))
def test_in_any_order_of_messages_it_answers_once_all_its_mentors_have_advised(order):
    # All are trusted alike, and no value is known: the two that agree count, the first of them.
    learner, outputs, actions = make_learner(), [], {ANNA: UP, BOB: RIGHT, CARL: RIGHT}
    for place, each in enumerate(order):
        assert outputs == [], place
        outputs += learner.observe(state()) if each == 'state' else hear(
            learner, each, action=actions[each])
    assert outputs == [Action(RUN, 1, 0, RIGHT, True, 1.0, learner=1, advice=RIGHT, mentor=BOB,
                              all_advice=(UP, RIGHT, RIGHT))]


def test_advice_that_comes_twice_or_late_changes_nothing():
    learner = make_learner()
    learner.observe(state())
    first = hear_all(learner)
    digest, count = learner.state.digest(), len(learner.journal_entries)
    assert hear_all(learner) == [] and learner.observe(state()) == tuple(first)
    learner.observe(state(step=1, s=3, reward=-1.0))
    learned = learner.state.digest()
    assert hear_all(learner, step=0) == []
    assert (learner.state.digest(), len(learner.journal_entries)) == (learned, count)
    assert learned == digest  # nothing is learned before the answer


def test_remembered_advice_counts_as_soon_as_that_of_all_is_there():
    learner = make_learner()
    learner.observe(state())
    hear_all(learner)
    learner.observe(state(step=1, s=3, reward=-1.0))
    hear_all(learner, step=1, s=3)
    action, = learner.observe(state(step=2, s=0, reward=-1.0))
    assert action.all_advice == (UP, UP, UP)
    other = make_learner(remembers_advice=False)
    other.observe(state())
    hear_all(other)
    other.observe(state(step=1, s=3, reward=-1.0))
    hear_all(other, step=1, s=3)
    assert other.observe(state(step=2, s=0, reward=-1.0)) == ()
    assert len(hear_all(other, step=2)) == 1


def test_it_names_the_first_mentor_that_it_waits_for():
    learner = make_learner()
    learner.observe(state())
    hear(learner, ANNA)
    hear(learner, CARL)
    assert learner.waiting_for() == 'a recommendation in state 0: is the mentor bob running?'
    hear(learner, BOB)
    assert learner.waiting_for() is None


def test_one_that_gave_no_advice_in_time_is_not_waited_for_until_it_gives_some():
    learner = make_learner()
    learner.observe(state())
    hear(learner, ANNA)
    action, = learner.continue_without_advice()
    assert (action.action, action.mentor, action.all_advice) == (UP, ANNA, (UP, -1, -1))
    learner.observe(state(step=1, s=3, reward=-1.0))
    action, = hear(learner, ANNA, step=1, s=3)  # nobody waits for the others
    assert action.all_advice == (UP, -1, -1)
    assert hear(learner, BOB, step=1, s=3) == ()  # late: from now on he is waited for
    assert learner.observe(state(step=2, s=4, reward=-1.0)) == ()
    assert hear(learner, ANNA, step=2, s=4) == ()
    assert learner.waiting_for() == 'a recommendation in state 4: is the mentor bob running?'
    action, = hear(learner, BOB, step=2, s=4, action=RIGHT)
    assert action.all_advice == (UP, RIGHT, -1)
    assert hear(learner, CARL, step=2, s=4) == ()


def test_it_goes_on_once_all_those_that_it_waits_for_are_left():
    learner = make_learner()
    learner.observe(state())
    hear(learner, CARL)
    assert learner.leave(['anna']) == ()  # bob is waited for
    assert learner.missing_mentors() == ['bob']
    action, = learner.leave(['bob'])
    assert action.all_advice == (-1, -1, UP)
    assert learner.observe(state(step=1, s=3, reward=-1.0)) == ()
    action, = hear(learner, CARL, step=1, s=3)  # nobody waits for the others
    assert action.all_advice == (-1, -1, UP)


def test_one_that_is_left_and_answers_in_time_for_the_others_counts():
    learner = make_learner(('anna', 'bob'))
    learner.observe(state())
    assert learner.leave(['anna']) == ()
    assert hear(learner, ANNA) == ()
    action, = hear(learner, BOB, action=RIGHT)
    assert action.all_advice == (UP, RIGHT)


def test_the_only_mentor_is_waited_for_again_in_the_next_state():
    learner = make_learner(('anna',))
    learner.observe(state())
    action, = learner.leave(['anna'])
    assert action.advice == -1
    assert learner.observe(state(step=1, s=3, reward=-1.0)) == ()
    assert learner.missing_mentors() == ['anna']


def test_nobody_is_left_where_nothing_waits():
    learner = make_learner(('anna', 'bob'))
    assert learner.leave(['anna']) == ()
    learner.observe(state())
    assert learner.missing_mentors() == ['anna', 'bob']


def test_the_advice_of_one_that_is_absent_is_still_remembered():
    learner = make_learner(('anna', 'bob'))
    learner.observe(state())
    hear(learner, ANNA)
    hear(learner, BOB, action=RIGHT)
    learner.observe(state(step=1, s=3, reward=-1.0))
    hear(learner, ANNA, step=1, s=3)
    learner.continue_without_advice()
    action, = learner.observe(state(step=2, s=0, reward=-1.0))
    assert action.all_advice == (UP, RIGHT)


def test_where_nobody_advises_in_time_it_acts_without_advice_and_waits_for_nobody():
    learner = make_learner()
    learner.observe(state())
    action, = learner.continue_without_advice()
    assert (action.followed, action.mentor, action.all_advice) == (False, 0, (-1, -1, -1))
    assert types(learner.observe(state(step=1, s=3, reward=-1.0))) == [Action]


def test_advice_that_cannot_be_right_is_rejected_and_the_others_count():
    learner = make_learner()
    learner.observe(state())
    rejected, = hear(learner, BOB, action=7)
    assert isinstance(rejected, Rejected)
    assert hear(learner, ANNA) == hear(learner, CARL) == ()
    assert len(hear(learner, BOB)) == 1


def end_episode(learner, episode=1):
    """Lead the learner to the goal, on advice of all; return the outputs there."""
    for step, s in ((1, 1), (2, 4), (3, 5)):
        learner.observe(state(episode, step, s, reward=-1.0))
        hear_all(learner, episode=episode, step=step, s=s)
    return learner.observe(state(episode, 4, 8, reward=10.0, terminated=True))


def joined():
    """Return a learner of anna's whose second episode has begun, in which bob has joined."""
    learner = make_learner(('anna',))
    learner.observe(state())
    hear_all(learner)
    learner.join('bob')
    end_episode(learner)
    learner.observe(state(episode=2))
    return learner


def test_one_who_joins_is_listened_to_from_the_next_episode_on():
    learner = make_learner(('anna',))
    learner.observe(state())
    hear_all(learner)
    learner.join('bob')
    learner.needs_checkpoint = False
    assert learner.expected_mentors == ('anna', 'bob') and learner.mentors == ('anna',)
    assert types(end_episode(learner)) == [Action]
    assert len(learner.receivers) == 1 and not learner.needs_checkpoint
    notice, = learner.observe(state(episode=2))
    assert notice == Notice('takes the advice of bob too')
    assert learner.mentors == learner.expected_mentors == ('anna', 'bob')
    assert learner.needs_checkpoint  # the journal does not say who has joined
    assert learner.waiting_for() == 'a recommendation in state 0: is the mentor bob running?'
    action, = hear(learner, BOB, episode=2, action=RIGHT)
    assert action.all_advice == (UP, RIGHT)


def joining(*held, name='bob'):
    """Return what a learner does in episode 2, where one joins whose advice it held before."""
    learner = make_learner(('anna',))
    learner.observe(state())
    hear_all(learner)
    learner.join(name)
    for each in held:
        assert learner.hold_advice(name, each) == ()
    end_episode(learner)
    outputs = learner.observe(state(episode=2))
    assert outputs[0] == Notice(f'takes the advice of {name} too')
    return learner, outputs[1:]


def test_one_who_joins_and_answered_the_first_observation_before_it_came_is_not_waited_for():
    late = advice(episode=1, step=3, s=5)._replace(mentor='bob')
    early = advice(episode=2, action=RIGHT)._replace(mentor='bob')
    learner, (action,) = joining(late, early)
    assert action.all_advice == (UP, RIGHT)
    assert ReceivedOtherAdvice(BOB, RUN, 2, 0, 0, RIGHT) in learner.journal_entries


@pytest.mark.parametrize('held', [
    advice(episode=1, step=3, s=5)._replace(mentor='bob'), advice(episode=2),
    advice(episode=2)._replace(mentor='bob', run=RUN + 1)],
    ids=['earlier', 'of another mentor', 'of another run'])
def test_other_advice_of_one_who_joins_does_not_count(held):
    learner, outputs = joining(held)
    assert outputs == ()
    assert learner.missing_mentors() == ['bob']
    action, = hear(learner, BOB, episode=2, action=RIGHT)
    assert action.all_advice == (UP, RIGHT)


def test_early_advice_that_cannot_be_is_rejected_when_its_mentor_joins():
    learner, (rejected,) = joining(advice(episode=2, action=9)._replace(mentor='bob'))
    assert type(rejected) is Rejected and learner.missing_mentors() == ['bob']


def test_nothing_is_held_of_a_mentor_that_does_not_join():
    learner = make_learner(('anna',))
    learner.observe(state())
    assert learner.hold_advice('bob', advice()._replace(mentor='bob')) == ()
    assert learner.missing_mentors() == ['anna']


def test_several_may_join_at_once_and_what_was_learned_stays():
    learner = make_learner(('anna',), trust='beta')
    learner.observe(state())
    hear_all(learner)
    for name in ('bob', 'carl'):
        learner.join(name)
    end_episode(learner)
    before = learner.state.belief.tolist()
    notice, = learner.observe(state(episode=2))
    assert notice == Notice('takes the advice of bob, carl too')
    assert learner.state.belief.tolist() == before + 18 * [before[8]]
    hear(learner, BOB, episode=2)
    action, = hear(learner, CARL, episode=2)
    assert action.all_advice == (UP, UP, UP)


@pytest.mark.parametrize('name, message', [
    ('anna', "each mentor must have a name of its own, got 'anna' twice"),
    ('bob', "each mentor must have a name of its own, got 'bob' twice"),
    ('a b', 'the name of a mentor must be a letter, then letters, digits and single underscores '
     "between them, got 'a b'")])
def test_a_name_that_cannot_be_does_not_join(name, message):
    learner = make_learner(('anna',))
    learner.join('bob')
    with pytest.raises(MentorNameError) as error:
        learner.join(name)
    assert str(error.value) == message
    assert learner.expected_mentors == ('anna', 'bob')


def test_the_seventeenth_mentor_does_not_join():
    learner = make_learner([f'm{number}' for number in range(16)])
    with pytest.raises(MentorNameError, match='must have 1 to 16 mentors, got 17'):
        learner.join('late')


def test_mentors_with_names_that_cannot_be_make_no_learner():
    with pytest.raises(MentorNameError, match='must have 1 to 16 mentors, got 0'):
        Learner(CONFIG, 0, mentors=())
    with pytest.raises(MentorNameError, match="of its own, got 'anna' twice"):
        Learner(CONFIG, 0, mentors=('anna', 'anna'))


def test_an_iteration_has_a_report_for_all_mentors_and_one_for_each():
    learner = make_learner(('anna', 'bob'), episodes=1)
    learner.observe(state())
    hear(learner, ANNA)
    learner.continue_without_advice()
    for step, s in ((1, 1), (2, 4), (3, 5)):
        learner.observe(state(step=step, s=s, reward=-1.0))
        hear(learner, ANNA, step=step, s=s)
    _, *reports = learner.observe(state(step=4, s=8, reward=10.0, terminated=True))
    assert types(reports) == 3 * [Progress]
    assert repr([(msg.mentor, msg.confidence) for msg in reports]) == repr(
        [('', 1.0), ('anna', 1.0), ('bob', float('nan'))])
    assert {msg[:6] for msg in reports} == {(RUN, 1, 3, 1, 4, 7.0)}


def test_its_mentors_stay_in_a_new_run_and_in_another_world():
    learner = joined()
    hear_all(learner, episode=2)
    follow_instead(learner, describe_world(grid('..G'), 'other', 9))
    learner.observe(state(run=9))
    outputs = [msg for m in (ANNA, BOB) for msg in hear(learner, m, run=9, action=RIGHT)]
    action, = (msg for msg in outputs if isinstance(msg, Action))
    assert action.all_advice == (RIGHT, RIGHT)
    assert learner.state.belief.shape == (6, 3)


def test_a_reset_forgets_what_was_learned_of_all_mentors_and_none_of_them():
    learner = make_learner(('anna', 'bob'), trust='beta')
    fresh = learner.state.digest()
    learner.observe(state())
    hear_all(learner)
    end_episode(learner)
    assert learner.state.digest() != fresh
    learner.reset()
    assert learner.state.digest() == fresh
    assert learner.advice().tolist() == 18 * [-1] and learner.mentors == ('anna', 'bob')


def test_its_journal_has_the_advice_of_each_mentor_that_it_acted_on():
    learner = make_learner(('anna', 'bob'))
    learner.journal_entries.clear()
    learner.observe(state())
    hear(learner, BOB, action=RIGHT)
    hear(learner, ANNA)
    assert learner.journal_entries == [
        ReceivedOtherAdvice(BOB, RUN, 1, 0, 0, RIGHT), ReceivedAdvice(RUN, 1, 0, 0, UP),
        OtherAdvice(BOB, RIGHT), AnsweredObservation(1, 0, 0, 0.0, False, False, UP)]


def restored(values, arrays, journal, names=NAMES, **settings):
    """Return a learner that continues from a checkpoint on disk and its journal."""
    learner = Learner(replace(CONFIG, **settings), 0, mentors=names)
    learner.load_state_dict(json.loads(json.dumps(values)),
                            {name: array.copy() for name, array in arrays.items()}, journal)
    return learner


@pytest.mark.parametrize('count', range(1, 8))
def test_a_learner_restored_from_any_part_of_its_journal_continues_the_same(count):
    learner = make_learner(trust='beta')
    values, arrays = learner.state_dict()
    arrays = {name: array.copy() for name, array in arrays.items()}
    learner.journal_entries.clear()
    steps = [(0, 0), (1, 1), (2, 4), (3, 1), (4, 0), (5, 3), (6, 0)]
    for step, s in steps[:count]:
        learner.observe(state(step=step, s=s, reward=-1.0 * (step > 0)))
        hear_all(learner, step=step, s=s)
    again = restored(values, arrays, learner.journal_entries, trust='beta')
    assert again.state.digest() == learner.state.digest()
    assert again.advice().tolist() == learner.advice().tolist()
    assert again.last_outputs() == learner.last_outputs()
    following = state(step=count, s=4, reward=-1.0)
    assert again.observe(following) == learner.observe(following)
    assert hear_all(again, step=count, s=4) == hear_all(learner, step=count, s=4)


def test_one_who_has_joined_is_in_the_checkpoint():
    again = restored(*joined().state_dict(), [], names=('anna',))
    assert again.mentors == ('anna', 'bob')
    again.observe(state(episode=2))
    action, = hear(again, BOB, episode=2)
    assert action.all_advice == (UP, UP)


def test_a_checkpoint_of_before_there_were_several_mentors_is_read():
    learner = make_learner(('',))
    learner.observe(state())
    hear_all(learner)
    learner.observe(state(step=1, s=3, reward=-1.0))
    hear_all(learner, step=1, s=3)
    values, arrays = learner.state_dict()
    advised, total = values['agent']['confidences']
    old_agent = {**values['agent'], 'advised': advised, 'confidence_sum': total,
                 'last_advice': values['agent']['last_advice'][0]}
    old = {**values, 'agent': old_agent, 'last_advice': values['last_advice'][0],
           'action': values['action'][:9], 'advised_action': values['advised_action'][:9]}
    del old['mentors'], old_agent['confidences'], arrays['confidences']
    again = restored(old, arrays, [], names=('',))
    assert again.last_outputs() == learner.last_outputs()
    following = state(step=2, s=0, reward=-1.0)
    assert again.observe(following) == learner.observe(following)
    assert again.state.digest() == learner.state.digest()
    assert again.mentors == ('',)


def test_late_advice_for_an_episode_long_past_is_ignored_for_each_mentor():
    learner = make_learner(('anna', 'bob'))
    learner.observe(state())
    hear_all(learner)
    values, arrays = learner.state_dict()
    again = restored(values, arrays, [], names=('anna', 'bob'))
    for m in (ANNA, BOB):  # after a restart, the observations of before are not known
        ignored, = hear(again, m)
        assert isinstance(ignored, Ignored)
