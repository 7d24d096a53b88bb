# SPDX-License-Identifier: Apache-2.0
"""When the page is a mentor beside others, and under which name; the other nodes are real ones."""

from contextlib import contextmanager

from node_processes import log_has, nodes
import pytest
import rclpy
from rclpy.parameter import Parameter
from ros_client import ros_client
from waiting import wait_until

from comply_ros.dashboard.dashboard_node import DashboardNode
from comply_ros.dashboard.mentor_ownership import MentorSeat
from comply_ros.dashboard.teaching_offer import (
    joining_text,
    learner_mentors,
    patience_text,
    teaching_offer,
)
from comply_ros.mentor.several_mentors import MentorNameError, MOST_MENTORS
from comply_ros.world.grid import NO_ACTION, RIGHT

WORLD = ['-p', 'map:=bar_grid', '-p', 'rate:=200.0']
LEARNER = ['-p', 'iterations:=0', '-p', 'episodes:=2', '-p', 'map_period:=0.2', '-p',
           'remembers_advice:=false']


@pytest.fixture
def context(domain):
    rclpy.init()
    yield
    rclpy.try_shutdown()


@contextmanager
def page(**parameters):
    """Give the node of a page and its seat; the end of the block is that of the page's node."""
    node = DashboardNode(parameter_overrides=[
        Parameter(name, value=value) for name, value in parameters.items()])
    seat = MentorSeat(node)
    try:
        with seat.open():
            yield node, seat
    finally:
        if seat.thread:
            seat.thread.mentor.destroy_node()
        node.close()
        node.destroy_node()


def updated(node, seat, condition, what):
    """Update a page until a condition is true."""
    wait_until(lambda: (node.update(), seat.update(), condition())[2], what)


def name_of(seat):
    """Name of the person as a mentor, None while the page watches."""
    return seat.thread.mentor.machine.name if seat.thread else None


@contextmanager
def lesson(folder, *mentors, expected=()):
    """Run a world, a learner and mentors with these names; the learner may name mentors."""
    named = ['-p', f'mentors:=[{", ".join(expected)}]'] if expected else []
    learner = [*LEARNER, *named]
    with nodes(folder / 'loop', grid_world=WORLD, learner=learner) as running:
        with named_mentors(folder, *mentors):
            yield running


@contextmanager
def named_mentors(folder, *mentors):
    """Run mentors with these names, one after the other."""
    if not mentors:
        yield
        return
    name, *others = mentors
    with nodes(folder / name, mentor=['-p', 'mentor:=optimal', '-p', f'name:={name}', '-r',
                                      f'__node:=mentor_{name}']) as running:
        wait_until(log_has(running['mentor'], 'ready'), name)
        with named_mentors(folder, *others):
            yield


def test_a_person_teaches_beside_mentors_with_names_and_the_learner_goes_on_after_it(
        context, tmp_path):
    with lesson(tmp_path, 'anna', 'bob'):
        with page() as (node, seat):
            updated(node, seat, lambda: set(node.page_state.mentor_names) == {'anna', 'bob'}
                    and learner_mentors(node.page_state) == ('anna', 'bob'), 'both mentors')
            assert seat.thread is None
            seat.take_over()
            updated(node, seat, lambda: learner_mentors(node.page_state) == (
                'anna', 'bob', 'person'), 'person among the mentors of the learner')
            assert seat.thread.mentor.get_name() == 'mentor_person'
            seat.thread.call('paint', {0: RIGHT}).result()
            reports = lambda: node.page_state.run.reports  # noqa: E731
            updated(node, seat, lambda: reports().confidence_in('person') is not None,
                    'confidence in the person')
            assert reports().of_mentor('person').policy[0] == RIGHT
            assert node.page_state.roles['mentor'].is_publishing
            updated(node, seat, lambda: 'mentor_person' in node.page_state.nodes, 'status of it')
        with page(teach='false') as (node, seat):
            updated(node, seat, lambda: node.page_state.run.reports.progress, 'an iteration')
            first = node.page_state.run.reports.progress.iteration
            updated(node, seat, lambda: node.page_state.run.reports.progress.iteration > first + 3,
                    'iterations without the person')
            assert seat.thread is None
        with page() as (node, seat):
            updated(node, seat, lambda: name_of(seat) == 'person', 'the person once more')


def test_a_page_is_the_mentor_that_the_learner_was_told_to_wait_for(context, tmp_path):
    with lesson(tmp_path, 'anna', expected=('person', 'anna')), page() as (node, seat):
        updated(node, seat, lambda: name_of(seat) == 'person', 'person')
        updated(node, seat, lambda: node.page_state.run.reports.progress, 'an iteration')
        assert learner_mentors(node.page_state) == ('person', 'anna')
        assert (seat.thread.mentor.policy == NO_ACTION).all()
        updated(node, seat, lambda: node.page_state.other_mentors == 1, 'the other mentor')
        assert name_of(seat) == 'person'  # though nobody has used it
        with page() as (other, other_seat):
            updated(other, other_seat, lambda: set(other.page_state.mentor_names) == {
                'anna', 'person'} and learner_mentors(other.page_state), 'what is there')
            other_seat.take_over()
            updated(other, other_seat, lambda: name_of(other_seat) == 'person_2', 'other name')


def test_a_page_that_comes_before_the_learner_gets_the_name_that_this_waits_for(
        context, tmp_path):
    with page() as (node, seat):
        updated(node, seat, lambda: name_of(seat) == '', 'mentor without a name')
        with lesson(tmp_path, 'anna', expected=('anna', 'person')):
            updated(node, seat, lambda: name_of(seat) == 'person', 'its name')


def test_a_page_stays_the_mentor_without_a_name_that_the_learner_waits_for(context, tmp_path):
    with nodes(tmp_path / 'loop', grid_world=WORLD, learner=LEARNER), page() as (node, seat):
        reports = lambda: node.page_state.run.reports  # noqa: E731
        updated(node, seat, lambda: name_of(seat) == '' and reports().progress, 'an iteration')
        with named_mentors(tmp_path, 'anna'):
            updated(node, seat, lambda: 'anna' in learner_mentors(node.page_state), 'anna')
            first = reports().progress.iteration
            updated(node, seat, lambda: reports().progress.iteration > first + 3, 'iterations')
            assert name_of(seat) == ''


def test_the_page_knows_how_long_the_learner_waits_for_the_person(context, tmp_path):
    with lesson(tmp_path, 'anna'), page() as (node, seat), ros_client() as client:
        updated(node, seat, lambda: learner_mentors(node.page_state) == ('anna',), 'anna')
        seat.take_over()
        text = lambda: patience_text(node.page_state, 'person', 5.0)  # noqa: E731
        updated(node, seat, lambda: 'person' in learner_mentors(node.page_state)
                and 'not 5 s' in text(), 'a wait that is shorter than the patience')
        for seconds, shown in ((30.0, '5'), (3.0, '3')):
            assert client.set('learner', **{'person.advice_timeout': seconds}) == ''
            updated(node, seat, lambda: text() == f'the robot waits {shown} s for a key', shown)


def test_a_page_that_shall_teach_has_a_name_where_others_have_one(context, tmp_path):
    with named_mentors(tmp_path, 'person'), page(teach='true') as (node, seat):
        updated(node, seat, lambda: seat.thread, 'person')
        assert name_of(seat) == 'person_2'


def test_a_name_that_is_given_is_used_at_once_and_must_be_one(context):
    with page(teach='true', name='eva') as (_, seat):
        assert name_of(seat) == 'eva'
    with pytest.raises(MentorNameError, match="a letter, then letters.*got '2nd'"):
        DashboardNode(parameter_overrides=[Parameter('name', value='2nd')])


def test_a_page_beside_a_learner_with_all_the_mentors_that_it_takes_says_so(context, tmp_path):
    expected = [f'm{number}' for number in range(MOST_MENTORS)]
    reason = 'the learner has 16 mentors, the most that it takes'
    with lesson(tmp_path, 'm0', expected=expected) as running, page() as (node, seat):
        updated(node, seat, lambda: teaching_offer(node.page_state, '') == (
            f'You watch: {reason}.', '', ''), 'reason')
        seat.take_over()
        updated(node, seat, lambda: name_of(seat) == 'person', 'person all the same')
        assert joining_text(node.page_state, 'person') == f'Your advice has no effect: {reason}.'
        wait_until(log_has(running['learner'], "the mentor 'person' cannot join"), 'refusal')


def test_a_page_beside_a_learner_that_takes_no_advice_says_so_until_it_does(context, tmp_path):
    learner = [*LEARNER, '-p', 'method:=sarsa']
    with nodes(tmp_path / 'loop', grid_world=WORLD, learner=learner), \
            named_mentors(tmp_path, 'anna'), page() as (node, seat):
        updated(node, seat, lambda: teaching_offer(node.page_state, '') == (
            'You watch: the learner takes no advice, since its parameter trust is none.', '', ''),
            'reason')
        with ros_client() as client:
            assert client.set('learner', trust='scheduled') == ''
        updated(node, seat, lambda: teaching_offer(node.page_state, '').button == 'Teach too',
                'offer')
