# SPDX-License-Identifier: Apache-2.0
"""What the page says to a person beside other mentors."""

import pytest
from test_dashboard_texts import page_state

from comply_ros.dashboard.remote_parameters import RemoteParameter
from comply_ros.dashboard.teaching_offer import (
    joining_text,
    patience_text,
    person_name,
    teaching_offer,
)
from comply_ros.mentor.several_mentors import MOST_MENTORS
from comply_ros.protocol.messages import LearnerDescription

SIXTEEN = tuple(f'm{number}' for number in range(MOST_MENTORS))


def state_with(others=(), mentors=(), **parameters):
    """Return a state with these other mentors, and a learner with mentors and parameters."""
    state = page_state(grid_world=0.5, learner=0.5)
    if mentors:
        state.run.reports.add('method', LearnerDescription(1, 7, 0, 'constant', '{}', 0, True, '',
                                                           mentors))
    return state._replace(
        other_mentors=len(others), mentor_names=others or ('',), parameters={
            'learner': {name: RemoteParameter(value, True) for name, value in parameters.items()}})


@pytest.mark.parametrize('given, others, mentors, name', [
    ('', [], ('',), ''), ('', [''], ('',), ''), ('', ['anna'], ('',), 'person'),
    ('', [], ('person', 'anna'), 'person'), ('', ['person', 'anna'], ('anna',), 'person_2'),
    ('', ['person', 'person_2'], (), 'person_3'), ('eva', ['anna'], (), 'eva'),
    ('eva', ['eva'], (), 'eva'), ('eva', [], ('',), 'eva')])
def test_a_person_has_a_name_beside_mentors_that_have_some(given, others, mentors, name):
    assert person_name(given, others, mentors) == name


@pytest.mark.parametrize('others, mentors, given, text, button', [
    (('',), ('',), '', 'Another mentor is heard, and you watch.', 'Take over'),
    (('',), ('',), 'eva', 'Another mentor advises, and you watch.', 'Teach too'),
    (('a', 'b', 'c'), (), '', '3 mentors advise, and you watch.', 'Teach too'),
    (('a', 'b'), ('a', 'b'), '', '2 mentors advise, and you watch.', 'Teach too'),
    ((), ('a', 'b'), '', 'No mentor advises, and you watch.', 'Teach'),
    (('a', 'eva'), ('a', 'eva'), 'eva', 'Another mentor has the name eva, and you watch.',
     'Take over'),
    (('a',), SIXTEEN, '', 'You watch: the learner has 16 mentors, the most that it takes.', ''),
    (('m0', 'm1'), SIXTEEN, 'm1', 'Another mentor has the name m1, and you watch.', 'Take over')])
def test_a_person_who_watches_reads_whether_to_teach(others, mentors, given, text, button):
    offer = teaching_offer(state_with(others, mentors), given)
    assert (offer.text, offer.button) == (text, button)


@pytest.mark.parametrize('mentors', [(), ('',), ('person', 'anna')])
def test_nothing_is_offered_where_the_page_teaches_in_a_moment(mentors):
    assert teaching_offer(state_with((), mentors), '') is None


def test_the_button_tells_the_name_and_when_it_counts():
    offer = teaching_offer(state_with(('person', 'anna')), '')
    assert offer.hint == 'be the mentor person_2 too, from the beginning of the next episode on'


@pytest.mark.parametrize('parameter, value, reason', [
    ('trust', 'none', 'the learner takes no advice, since its parameter trust is none'),
    ('learns', False, 'the learner takes no advice, since its parameter learns is false')])
def test_a_learner_that_takes_no_advice_is_named_with_the_reason(parameter, value, reason):
    state = state_with(('anna',), ('anna',), **{parameter: value})
    assert teaching_offer(state, '')[:2] == (f'You watch: {reason}.', '')
    assert joining_text(state, 'person') == f'Your advice has no effect: {reason}.'


def test_a_person_reads_until_the_learner_takes_the_advice():
    later = 'The learner takes your advice from the beginning of its next episode on.'
    assert joining_text(state_with(('anna',), ('anna',)), 'person') == later
    assert joining_text(state_with(('anna',), ('anna', 'person')), 'person') == ''
    assert joining_text(state_with((), ('',)), '') == ''
    assert joining_text(state_with(), 'person') == ''  # no learner is known
    assert joining_text(state_with(('m0',), SIXTEEN), 'person') == (
        'Your advice has no effect: the learner has 16 mentors, the most that it takes.')


@pytest.mark.parametrize('mentors, timeouts, patience, seconds', [
    (['person', 'anna'], {}, 5.0, '5'),
    (['person', 'anna'], {'advice_timeout': 2.0}, 5.0, '2'),
    (['person', 'anna'], {'advice_timeout': 2.0, 'person.advice_timeout': 3.5}, 5.0, '3.5'),
    (['anna'], {'person.advice_timeout': 30.0}, 5.0, '5'),
    (['anna'], {'advice_timeout': 0.3}, 5.0, '0.3'),  # also of a mentor that was found
    (['anna'], {}, 1.0, '1')])
def test_how_long_a_key_is_waited_for_depends_on_the_learner(mentors, timeouts, patience, seconds):
    state = learner_with(mentors=mentors, **timeouts)
    assert patience_text(state, 'person', patience) == f'the robot waits {seconds} s for a key'


def test_a_learner_that_found_the_person_does_not_wait_for_a_key_for_long():
    assert patience_text(state_with(), 'person', 2.5) == 'the robot waits 2.5 s for a key'
    for timeouts in ({}, {'advice_timeout': 4.0, 'person.advice_timeout': 0.0}):
        assert patience_text(learner_with(mentors=['anna'], **timeouts), 'person', 5.0) == (
            'the robot waits 1 to 2 s for a key, not 5 s, then goes on until the next key')


def learner_with(**parameters):
    """Return the state of a page whose learner has these parameters."""
    return state_with()._replace(parameters={'learner': {
        name: RemoteParameter(value, False) for name, value in parameters.items()}})
