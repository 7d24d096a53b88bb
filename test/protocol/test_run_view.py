# SPDX-License-Identifier: Apache-2.0
"""What viewer, page, run monitor and plots know of a run: the newest message of each kind."""

from array import array

import numpy as np
import pytest
from tiny_worlds import grid

from comply_ros.mentor.several_mentors import MOST_MENTORS
from comply_ros.protocol.iteration_curve import IterationCurve
from comply_ros.protocol.mentor_topics import name_of_mentor
from comply_ros.protocol.messages import (
    Episode,
    LearnerDescription,
    Notice,
    Policy,
    Progress,
    Recommendation,
    Rejected,
    StateReward,
    Trust,
    Values,
)
from comply_ros.protocol.run_reports import RunReports
from comply_ros.protocol.run_view import RunView
from comply_ros.protocol.state_maps import NOTHING, OF_MENTOR, STATE_MAPS
from comply_ros.protocol.world_description import describe_world

GRID = grid('..G', '...')
HERE = describe_world(GRID, 'room', 7)
ALL_TOPICS = {'world', 'state', 'progress', *STATE_MAPS}


def state(s, step, episode=1, run=7):
    """Return an observation."""
    return StateReward(run, episode, step, s, 0.0 if step == 0 else -1.0, s == 5, False)


def progress(run, iteration, mean_return=0.0):
    """Return a `Progress` of a training without limit."""
    return Progress(run, iteration, 0, 15, 100 * iteration, mean_return, 0.5, 1.0, False)


def trust(values, run=7):
    """Return a `Trust`."""
    return Trust(run, array('f', values))


def shown(view, topic, mentor=''):
    """Return the array of a topic that a view has, of a mentor."""
    return getattr(view.reports.of_mentor(mentor), OF_MENTOR[topic]) if topic in OF_MENTOR \
        else getattr(view.reports, topic)


def learner(*mentors):
    """Return the description of a learner with these mentors."""
    return LearnerDescription(7, 5, 0, 'explicit', '{}', 0, True, '', mentors)


@pytest.fixture
def view():
    """Return a view that follows the run in the room."""
    made = RunView(lambda is_reset: (Notice('new run'),), trail_length=3)
    assert made.receive('world', HERE) == (Notice('new run'),)
    return made


def test_everything_changes_with_a_new_run(view):
    assert view.changed == ALL_TOPICS and view.reports.description == HERE


def test_the_trail_has_the_last_states_of_this_episode(view):
    view.changed.clear()
    for step, s in enumerate((0, 0, 1, 2)):
        assert view.receive('state', state(s, step)) == ()
    assert (view.trail, view.changed) == ([0, 1, 2], {'state'})
    view.receive('state', state(5, 4))
    assert view.trail == [1, 2, 5]
    view.receive('state', state(0, 0, episode=2))
    assert view.trail == [0]


def test_a_repeated_state_changes_nothing(view):
    view.receive('state', state(0, 0))
    view.changed.clear()
    view.receive('state', state(0, 0))
    assert (view.trail, view.changed) == ([0], set())


@pytest.mark.parametrize('s', [9, 99])
def test_a_state_that_cannot_be_right_is_rejected_and_not_shown(view, s):
    view.receive('state', state(0, 0))
    rejected, = view.receive('state', state(s, 1))
    assert type(rejected) is Rejected
    assert view.trail == [0] and view.reports.observation.state == 0


def test_nothing_is_known_before_a_world():
    view = RunView()
    view.receive('trust', trust([0.5] * 6))
    assert view.world is None and view.reports.mentors == {}
    assert view.waiting_for() == 'a world: is a grid_world running?'


def test_messages_that_came_before_their_world_are_shown_with_it():
    view = RunView()
    view.receive('state', state(0, 0))
    view.receive('trust', trust([0.5] * 6))
    view.receive('trust', trust([0.9] * 6, run=8))
    view.receive('progress', progress(7, 1))
    view.receive('world', HERE)
    assert view.reports.of_mentor().trust.tolist() == [0.5] * 6 and view.reports.values is None
    assert view.reports.curve.iterations == (1,)
    assert view.reports.observation.state == 0


def test_messages_of_another_run_change_nothing(view):
    view.changed.clear()
    view.receive('trust', trust([0.9] * 6, run=8))
    view.receive('progress', progress(8, 1))
    view.receive('mentor_policy', Policy(8, array('h', [0] * 6)))
    reports = view.reports
    assert view.changed == set()
    assert (reports.progress, reports.of_mentor()) == (None, NOTHING)


@pytest.mark.parametrize('topic, msg, text', [
    ('trust', trust([0.5] * 5), 'trust must have the 6 states of the world, got 5'),
    ('trust', trust([0.5] * 5 + [float('nan')]), 'trust must lie in [0, 1], got nan'),
    ('trust', trust([1.5] * 6), 'trust must lie in [0, 1], got 1.5'),
    ('values', Values(7, array('d', [float('inf')] * 6)),
     'values must be finite numbers, got inf'),
    ('mentor_policy', Policy(7, array('h', [0] + [-1] * 5)),
     "mentor_policy: an action must not leave the grid, got '<' in state 0"),
    ('policy', Policy(7, array('h', [4] + [-1] * 5)), 'policy: an action must be 0 left')])
def test_a_map_that_cannot_be_of_this_world_is_rejected_and_removed(view, topic, msg, text):
    rejected, = view.receive(topic, msg)
    assert rejected.reason.startswith(text)
    assert shown(view, topic) is None


def test_maps_are_arrays_of_their_type(view):
    view.receive('mentor_policy', Policy(7, array('h', [1, 1, 3, 1, 1, -1])))
    assert view.reports.of_mentor().policy.dtype == np.int8
    view.receive('trust', trust([0.5] * 6))
    assert view.reports.of_mentor().trust.dtype == np.float32


def test_another_world_is_followed_when_this_one_is_silent_and_that_one_publishes(view):
    view.receive('state', state(0, 0))
    view.receive('world', describe_world(grid('.G'), 'beside', 8))
    outputs = ()
    for _ in range(3):
        view.receive('state', state(0, 0, run=8))
        outputs += view.tick()
    assert outputs[:1] == (Notice('new run'),)
    assert (view.tracker.run, view.world.grid, view.trail) == (8, grid('.G'), [0])


def test_a_world_that_comes_back_with_another_run_is_followed(view):
    view.receive('state', state(0, 1, episode=3))
    view.receive('world', HERE._replace(run=9))
    assert view.tracker.run == 7
    for step in range(3):
        view.tick()
        view.receive('state', state(1, step, run=9) if step else state(0, 0, run=9))
    view.tick()
    assert view.tracker.run == 9 and view.reports.observation.step == 2


def test_many_other_runs_neither_use_memory_nor_remove_the_one_that_is_followed(view):
    view.receive('progress', progress(7, 1))
    for run in range(100, 200):
        view.receive('progress', progress(run, 1))
    view.receive('world', HERE._replace(run=199, replaces=7))
    assert view.reports.curve.iterations == (1,)
    view.receive('world', HERE._replace(run=101, replaces=199))
    assert view.reports.curve.iterations == ()  # it was one of too many


def test_the_history_has_every_result_and_the_newest_advice():
    reports = RunReports(history=True)
    for number in (1, 2, 2):
        reports.add('progress', progress(7, number, float(number)))
        reports.add('episode', Episode(7, number, 9, 1.0, True, False))
    reports.add('recommendation', Recommendation(7, 1, 0, 4, 2))
    reports.add('recommendation', Recommendation(7, 1, 2, 4, 3))
    reports.add('state', state(4, 2))
    assert list(reports.progress_by_iteration) == [1, 2]
    assert list(reports.episodes) == [(7, 1), (7, 2)]
    assert (reports.advice, reports.visited) == ({'': {4: 3}}, {4})


def test_each_mentor_has_its_trust_its_policy_and_its_advice(view):
    for name, confidence, action in (('anna', 0.25, 1), ('bob', 0.75, 3)):
        view.receive('trust', trust([confidence] * 6)._replace(mentor=name))
        policy = Policy(7, array('h', [action, action, -1, -1, -1, -1]))
        view.receive(f'mentors/{name}/mentor_policy', policy)
        view.receive(f'mentors/{name}/recommendation', Recommendation(7, 1, 0, 4, action, name))
    assert shown(view, 'trust', 'anna').tolist() == [0.25] * 6
    assert shown(view, 'trust', 'bob').tolist() == [0.75] * 6
    assert shown(view, 'mentor_policy', 'bob').tolist()[:2] == [3, 3]
    assert view.reports.advice == {'anna': {4: 1}, 'bob': {4: 3}}
    assert view.reports.of_mentor() == NOTHING
    assert view.changed == ALL_TOPICS | {'recommendation'}


def test_the_confidence_in_each_mentor_is_no_result_of_an_iteration():
    reports = RunReports(history=True)
    reports.add('method', learner('anna', 'bob'))
    for iteration in (1, 2):
        msg = progress(7, iteration, float(iteration))
        for name, confidence in (('', 0.5), ('anna', 0.25), ('bob', float('nan'))):
            reports.add('progress', msg._replace(mentor=name, confidence=confidence))
    assert reports.curve == IterationCurve((1, 2), (1.0, 2.0))
    assert (reports.progress.mentor, list(reports.progress_by_iteration)) == ('', [1, 2])
    assert [reports.confidence_in(name) for name in ('anna', 'bob')] == [0.25, None]


def test_the_confidence_in_a_mentor_without_a_name_follows_that_in_all():
    reports = RunReports()
    reports.add('method', learner('', 'anna'))
    for name, confidence in (('', 0.5), ('', 0.75), ('anna', 0.25)):
        reports.add('progress', progress(7, 1)._replace(mentor=name, confidence=confidence))
    assert (reports.progress.confidence, reports.confidence_in('')) == (0.5, 0.75)


def test_the_confidence_in_the_only_mentor_is_that_of_the_iteration():
    reports = RunReports()
    assert reports.confidence_in('') is None
    reports.add('progress', progress(7, 1))
    assert reports.confidence_in('') == 0.5


def test_the_confidence_in_each_mentor_is_a_curve_over_the_iterations():
    reports = RunReports()
    reports.add('method', learner('anna', 'bob'))
    for iteration in (1, 2, 3, 2):  # it is reset after the third
        for name, confidence in (('', 0.5), ('anna', 0.25 * iteration), ('bob', 0.1)):
            reports.add('progress', progress(7, iteration)._replace(
                mentor=name, confidence=confidence))
    assert reports.confidence_curve('anna') == IterationCurve((1, 2), (0.25, 0.5))
    assert reports.confidence_curve('bob') == IterationCurve((1, 2), (0.1, 0.1))
    assert reports.confidence_curve('carl') == IterationCurve()


def test_the_curve_of_the_first_mentor_begins_before_others_joined():
    reports = RunReports()
    for iteration in (1, 2):
        reports.add('progress', progress(7, iteration))
    assert reports.confidence_curve('') == IterationCurve((1, 2), (0.5, 0.5))
    reports.add('method', learner('anna', 'bob'))
    for name, confidence in (('', 0.6), ('anna', 0.7), ('bob', 0.2)):
        reports.add('progress', progress(7, 3)._replace(mentor=name, confidence=confidence))
    assert reports.confidence_curve('anna') == IterationCurve((1, 2, 3), (0.5, 0.5, 0.7))
    assert reports.confidence_curve('bob') == IterationCurve((3,), (0.2,))


def test_the_curve_of_one_that_gives_no_advice_any_more_ends_where_others_joined():
    reports = RunReports()
    for iteration in (1, 2):
        reports.add('progress', progress(7, iteration))
    reports.add('method', learner('', 'anna'))
    for name in ('', 'anna'):  # of the iteration, and of anna alone
        reports.add('progress', progress(7, 3)._replace(mentor=name, confidence=0.7))
    assert reports.confidence_curve('') == IterationCurve((1, 2), (0.5, 0.5))
    assert reports.confidence_curve('anna') == IterationCurve((3,), (0.7,))


@pytest.mark.parametrize('mentors, policies, names', [
    (None, (), ('',)), (('',), ('',), ('',)), (('',), ('anna',), ('anna',)),
    (('bob', 'anna'), ('', 'anna', 'carl'), ('bob', 'anna', '', 'carl')),
    (('', 'anna'), ('anna',), ('', 'anna'))])
def test_the_mentors_of_the_learner_are_named_first_in_its_order(view, mentors, policies, names):
    if mentors:
        view.receive('method', learner(*mentors))
    for name in policies:
        view.receive(name_of_mentor('mentor_policy', name), Policy(7, array('h', 6 * [-1])))
    assert view.reports.mentor_names() == names


def test_a_wrong_map_of_one_mentor_removes_no_other(view):
    for name in ('anna', 'bob'):
        view.receive('trust', trust([0.5] * 6)._replace(mentor=name))
    rejected, = view.receive('trust', trust([1.5] * 6)._replace(mentor='bob'))
    assert rejected.reason == 'trust in bob must lie in [0, 1], got 1.5'
    rejected, = view.receive('mentors/anna/mentor_policy', Policy(7, array('h', [-1])))
    assert rejected.reason == ('mentors/anna/mentor_policy must have the 6 states of the world, '
                               'got 1')
    assert shown(view, 'trust', 'bob') is None and shown(view, 'trust', 'anna') is not None


def test_names_that_no_mentor_can_have_are_passed_over_and_so_are_too_many(view):
    for name in ('<b>', 'a/b', *(f'mentor{number}' for number in range(50))):
        view.receive('trust', trust([0.5] * 6)._replace(mentor=name))
    assert list(view.reports.mentors)[:2] == ['mentor0', 'mentor1']
    assert len(view.reports.mentors) == MOST_MENTORS + 1
    view.receive('method', learner('a', 'a'))
    assert view.reports.learner is None


@pytest.mark.parametrize('fields', [
    {'mean_return': float('nan')}, {'temperature': -1.0}, {'confidence': 2.0}, {'episodes': 0},
    {'finished': True}])
def test_a_progress_that_cannot_be_right_is_passed_over(view, fields):
    view.receive('progress', progress(7, 1)._replace(**fields))
    assert view.reports.progress is None
