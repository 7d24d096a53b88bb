# SPDX-License-Identifier: Apache-2.0
"""A learner with several mentor nodes: named in advance, found while it runs, killed."""

from contextlib import contextmanager
import re
import time

from lesson_summaries import assert_equal_but_for_time, lesson_summary, trained_summary
from node_processes import log_has
import pytest
from ros_client import ros_client
from short_training import digest_of
from waiting import wait_until

import comply_ros
from comply_ros.nodes.node_processes import run_nodes
from comply_ros.nodes.topics import ACTION
from comply_ros.protocol.messages import step_id

pytestmark = pytest.mark.usefixtures('domain')

TEACHERS = {'anna': 'optimal', 'bob': 'noisy:0.5', 'carl': 'random'}
SHORT = ('-p', 'iterations:=8', '-p', 'episodes:=4', '-p', 'seed:=1', '-p', 'map_period:=0.0')
ENDLESS = ('-p', 'iterations:=0', '-p', 'episodes:=4')


@contextmanager
def teachers(folder, names):
    """Run a mentor node for each name, and give them by name."""
    folder.mkdir(exist_ok=True)
    arguments = {f'mentor_{name}': ('-p', f'name:={name}', '-p', f'mentor:={TEACHERS[name]}',
                                    '-p', f'seed:={list(TEACHERS).index(name)}')
                 for name in names}
    with run_nodes(arguments, folder, executables=dict.fromkeys(arguments, 'mentor')) as started:
        yield dict(zip(names, started))


@contextmanager
def school(folder, learner, names=tuple(TEACHERS)):
    """Run a world, a learner with these arguments and mentors; give the learner and those."""
    folder.mkdir(exist_ok=True)
    with run_nodes({'grid_world': ('-p', 'map:=bar_grid', '-p', 'seed:=1'),
                    'learner': learner}, folder) as (_, own), teachers(folder, names) as mentors:
        yield own, mentors


@pytest.fixture(scope='module')
def expected():
    """Return the digest of a training in one process with the same mentors."""
    mentors = [f'{name}={spec}' for name, spec in TEACHERS.items()]
    return comply_ros.train('bar_grid', 'explicit', mentors, seed=1, iterations=8,
                            episodes=4).digest


@pytest.mark.parametrize('learner', [
    ('-p', 'mentors:=[anna, bob, carl]'),
    pytest.param(('-p', 'mentors:=[anna, bob, carl]', '-p', 'remembers_advice:=false'),
                 marks=pytest.mark.long)], ids=['remembers', 'asks'])
def test_mentors_that_are_named_in_advance_give_the_bits_of_one_process(
        tmp_path, expected, learner):
    with school(tmp_path, ('-p', 'method:=explicit', *SHORT, *learner), ('carl', 'anna')) as (
            own, _), teachers(tmp_path / 'late', ['bob']):
        assert digest_of(own) == expected


@pytest.mark.long
def test_a_lesson_with_several_mentors_gives_the_bits_of_train(tmp_path):
    argv = ('--map', 'bar_grid', '--iterations', '3', '--episodes', '5', '--mentors', 'optimal',
            'anna=noisy:0.5', 'noisy:0.5')
    summary = trained_summary(tmp_path / 'train', *argv)
    assert list(summary['mentor_returns']) == ['optimal', 'anna', 'noisy_0_5']
    assert summary['mentor_returns']['anna'] != summary['mentor_returns']['noisy_0_5']
    assert_equal_but_for_time(summary, lesson_summary(tmp_path / 'lesson', *argv))


def test_a_learner_takes_the_mentors_that_it_finds_and_goes_on_without_a_dead_one(tmp_path):
    with school(tmp_path, ENDLESS, ['anna']) as (own, mentors):
        wait_until(log_has(own, 'takes the advice of anna'), 'the first mentor is found')
        with teachers(tmp_path / 'late', ['bob']) as late:
            wait_until(log_has(own, 'takes the advice of bob too'), 'the second one joins')
            late['bob'].kill()
            wait_until(log_has(own, 'the mentor bob does not answer: continues without it'),
                       'the learner goes on')
        mentors['anna'].check()


@pytest.mark.parametrize('given', [('-p', 'bob.advice_timeout:=5.0'), ()])
def test_a_named_and_a_found_mentor_are_waited_for_for_their_own_times(tmp_path, given):
    asks = (*ENDLESS, '-p', 'remembers_advice:=false')  # for advice in every step
    with ros_client() as client, school(tmp_path, (
            *asks, '-p', 'mentors:=[anna]', '-p', 'anna.advice_timeout:=1.0', *given),
            ['anna']) as (own, mentors), teachers(tmp_path / 'late', ['bob']) as late:
        wait_until(log_has(own, 'takes the advice of bob too'), 'the second one joins')
        if not given:
            assert client.get('learner', 'bob.advice_timeout') == 0.0
            assert client.set('learner', **{'bob.advice_timeout': 5.0}) == ''
        client.subscribe(ACTION)
        assert 4.0 < seconds_of_silence(client, late['bob'], 4.0) < 10.0
        wait_until(log_has(own, 'no recommendation of bob came within 5.0 s'), 'reason')
        assert 0.8 < seconds_of_silence(client, mentors['anna'], 0.8) < 3.0


def test_a_found_mentor_is_left_though_another_one_has_a_longer_timeout(tmp_path):
    asks = (*ENDLESS, '-p', 'remembers_advice:=false', '-p', 'anna.advice_timeout:=600.0')
    with school(tmp_path, asks, ['anna', 'bob']) as (own, mentors):
        wait_until(lambda: all(re.search(f'takes the advice of .*{name}', own.log.read_text())
                               for name in ('anna', 'bob')), 'both join')
        for mentor in mentors.values():
            mentor.kill()
        wait_until(log_has(own, 'the mentor bob does not answer'), 'bob is left')
        wait_until(log_has(own, 'is the mentor anna running?'), 'anna is waited for')


def seconds_of_silence(client, mentor, least):
    """Kill a mentor; return how long no new action comes then, once that is at least so long."""
    actions = client.received['action']
    client.until(lambda: actions, 'actions with the mentor')
    mentor.kill()
    newest, since = step_id(actions[-1]), time.monotonic()

    def silence():
        nonlocal newest, since
        before = since
        if step_id(actions[-1]) != newest:  # an action that nobody has answered is repeated
            newest, since = step_id(actions[-1]), time.monotonic()
        return since - before > least and since - before
    return client.until(silence, 'action without the mentor')


def test_a_timeout_of_a_found_mentor_survives_a_kill_of_the_learner(tmp_path):
    with ros_client() as client, school(tmp_path, (
            *ENDLESS, '-p', f'state_dir:={tmp_path / "state"}'), ['anna', 'bob']) as (own, _):
        wait_until(log_has(own, 'takes the advice of anna'), 'the mentors are found')
        client.until(lambda: client.set('learner', **{'bob.advice_timeout': 4.0}) == '',
                     'parameter of the mentor that was found')
        wait_until(log_has(own, 'continues with bob.advice_timeout 4.0'), 'change')
        own.kill()
        own.start()
        wait_until(log_has(own, 'continues after'), 'learner again')
        assert client.get('learner', 'bob.advice_timeout') == 4.0


def test_a_timeout_of_a_mentor_that_has_not_come_is_named_and_kept(tmp_path):
    file = tmp_path / 'timeouts.yaml'
    file.write_text('/**/learner: {ros__parameters: {late: {advice_timeout: 2.5}}}')
    with ros_client() as client, school(tmp_path, (
            *ENDLESS, '--params-file', str(file), '-p', 'mentors:=[late]', '-p',
            'lat.advice_timeout:=1.0', '-p', 'carl.advice_timeout:=2', '-p',
            'late.advice_timeot:=3.0'), []) as (own, _):
        later = 'has no effect until a mentor'
        for text in (
                f"parameter 'lat.advice_timeout' {later} lat joins; did you mean 'late'?",
                f"parameter 'carl.advice_timeout' {later} carl joins\n",
                "parameter 'late.advice_timeot' is unknown and has no effect; the only one of a "
                "mentor is 'late.advice_timeout'"):
            wait_until(log_has(own, text), text)
        assert client.get('learner', 'carl.advice_timeout') == 2.0
        assert client.get('learner', 'late.advice_timeout') == 2.5


def test_a_mentor_that_is_named_is_waited_for_by_name(tmp_path):
    with school(tmp_path, (*ENDLESS, '-p', 'mentors:=[anna, bob]'), ['anna']) as (own, _):
        wait_until(log_has(own, 'is the mentor bob running?'), 'it says for whom it waits')


def test_a_mentor_with_a_timeout_of_its_own_is_left_and_the_others_are_waited_for(tmp_path):
    with school(tmp_path, (*ENDLESS, '-p', 'mentors:=[anna, bob]', '-p',
                           'bob.advice_timeout:=0.05'), []) as (own, _):
        wait_until(log_has(own, 'no recommendation of bob came within 0.05 s'), 'bob is left')
        wait_until(log_has(own, 'waits for a recommendation in state'), 'anna is not')
        assert 'is the mentor anna running?' in own.log.read_text()


@pytest.mark.parametrize('learner, message', [
    ('bob.advice_timeout:=-1.0', 'parameter bob.advice_timeout must lie in [0, 3600], got -1.0'),
    ('bob.advice_timeout:=.nan', 'parameter bob.advice_timeout must lie in [0, 3600], got nan'),
    ('bob.advice_timeout:=one', "parameter bob.advice_timeout must be a double such as 1.0, got "
     "'one'"),
    ('mentors:=[anna, anna]', "each mentor must have a name of its own, got 'anna' twice"),
    ('mentors:=[a b]', "the name of a mentor must be a letter, then letters, digits and single "
     "underscores between them, got 'a b'")])
def test_mentors_that_cannot_be_end_a_learner_in_a_sentence(tmp_path, learner, message):
    with run_nodes({'learner': ('-p', learner)}, tmp_path) as (own,):
        wait_until(lambda: own.end_report() is not None, 'it has ended')
        assert message in own.log.read_text() and 'exit code 2' in own.end_report()
