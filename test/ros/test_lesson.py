# SPDX-License-Identifier: Apache-2.0
"""A lesson is real processes, and gives the bits of `train`."""

import os
import signal
import subprocess
import sys

from golden_digests import CHANGED, golden_digests
from lesson_summaries import assert_equal_but_for_time, lesson_summary, trained_summary
from node_processes import log_has, nodes, run
import pytest
from short_training import children
from waiting import DEADLINE, wait_until

from comply_ros.nodes.lesson import TAKEN
from comply_ros.nodes.node_processes import START

pytestmark = pytest.mark.usefixtures('domain')

GOLDEN = golden_digests('lesson')
SMALL = ('--map', 'bar_grid', '--mentor', 'noisy:0.3', '--iterations', '3', '--episodes', '5')


@pytest.mark.parametrize('method', ['watkins', 'beta_implicit'])
@pytest.mark.long
def test_lesson_gives_the_digest_of_train(tmp_path, method):
    argv = ('--method', method, '--iterations', '2', '--mentor', 'snapshot:0.5',
            '--seed', '3')
    expected = trained_summary(tmp_path / 'train', *argv)
    assert expected['steps'] >= 5_000
    assert_equal_but_for_time(expected, lesson_summary(tmp_path / 'lesson', *argv))


@pytest.mark.parametrize('method', ['q_learning', 'jump_start'])
@pytest.mark.long
def test_a_short_lesson_of_other_methods_gives_it_too(tmp_path, method):
    assert_equal_but_for_time(
        trained_summary(tmp_path / 'train', *SMALL, '--method', method),
        lesson_summary(tmp_path / 'lesson', *SMALL, '--method', method))


@pytest.mark.parametrize('more', [
    (), pytest.param(('--method', 'explicit', '--budget', '9', '--advising', 'mistakes'),
                     marks=pytest.mark.long)])
def test_a_lesson_in_an_environment_without_a_table_gives_it_too(tmp_path, more):
    pytest.importorskip('gymnasium')
    argv = ('--map', 'gym:MountainCar-v0?bins=6,8&limits=-1,0.5;-0.07,0.06', '--mentor', 'random',
            '--iterations', '2', '--episodes', '2', '--seed', '3', *more)
    expected = trained_summary(tmp_path / 'train', *argv)
    assert expected['optimal_return'] is None and expected['steps'] > 300
    assert_equal_but_for_time(expected, lesson_summary(tmp_path / 'lesson', *argv))


@pytest.mark.parametrize('method', [  # test/protocol has all methods, in one process
    pytest.param('sarsa_lambda', marks=pytest.mark.long), 'explicit'])
def test_lesson_gives_the_digest_of_train_as_the_text_says(tmp_path, method):
    argv = (*SMALL, '--method', method, '--profile', 'report', '--set', 'temperature=0.7')
    assert_equal_but_for_time(trained_summary(tmp_path / 'train', *argv),
                              lesson_summary(tmp_path / 'lesson', *argv))


@pytest.mark.parametrize('argv', [
    ('--mentor', 'noisy:0.3@0.4', '--map', 'maze_as_run'),
    ('--budget', '20', '--advising', 'important'), ('--budget', '20', '--advising', 'mistakes')])
@pytest.mark.long
def test_a_mentor_with_little_advice_gives_the_same_over_topics(tmp_path, argv):
    argv = (*SMALL, *argv)
    assert_equal_but_for_time(trained_summary(tmp_path / 'train', *argv),
                              lesson_summary(tmp_path / 'lesson', *argv))


def test_a_lesson_leaves_results_logs_and_its_parameters(tmp_path):
    lesson_summary(tmp_path, *SMALL)
    assert sorted(os.listdir(tmp_path)) == [
        'confidence.png', 'grid_world.log', 'learner.log', 'learning.npz', 'learning_curve.png',
        'mentor.log', 'mentor.txt', 'parameters.yaml', 'summary.json', 'trust_map.png']
    for name in ('grid_world', 'mentor', 'learner'):
        assert 'Traceback' not in (tmp_path / f'{name}.log').read_text()


def test_a_map_and_a_policy_from_files_are_used(tmp_path, monkeypatch):
    (tmp_path / 'mine.yaml').write_text(
        'intended: 0.9\nstep_limit: 40\nrewards: {step: -1, goal: 9}\nstarts: anywhere\n'
        "rows: ['..G', '...']\n")
    (tmp_path / 'mine.txt').write_text('>>G\n>>^\n')
    monkeypatch.chdir(tmp_path)
    argv = ('--map', 'mine.yaml', '--mentor', 'file:mine.txt', '--iterations', '3')
    assert_equal_but_for_time(trained_summary(tmp_path / 'a', *argv),
                              lesson_summary(tmp_path / 'b', *argv))


@pytest.fixture
def lesson(tmp_path):
    """Return a lesson that takes long, and the folder where it writes, with its nodes alive."""
    process = subprocess.Popen(
        [sys.executable, '-c', START.format('lesson'), '--map', 'bar_grid', '--mentor', 'optimal',
         '--iterations', '100000', '--out', str(tmp_path)],
        stderr=subprocess.PIPE, text=True, start_new_session=True)
    for name, text in (('learner', 'starts to learn'), ('grid_world', 'ready'),
                       ('mentor', 'ready')):
        log = tmp_path / f'{name}.log'
        wait_until(lambda log=log, text=text: log.exists() and text in log.read_text(), text)
    yield process, tmp_path
    process.terminate()
    process.communicate(timeout=DEADLINE)


@pytest.mark.parametrize('name', [
    *(pytest.param(name, marks=pytest.mark.long) for name in ('grid_world', 'mentor')), 'learner'])
def test_a_node_that_dies_ends_the_lesson_with_its_name(lesson, name):
    process, folder = lesson
    ids = children(process)
    os.kill(ids[name], signal.SIGKILL)
    errors = process.communicate(timeout=DEADLINE)[1]
    assert process.returncode == 1
    assert f'lesson: {name} ended with signal SIGKILL; its last lines:\n' in errors
    assert 'ready' in errors and 'Traceback' not in errors
    assert not any(os.path.exists(f'/proc/{pid}') for pid in ids.values())
    assert not (folder / 'summary.json').exists()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_a_lesson_and_its_nodes(lesson, number):
    process, folder = lesson
    ids = children(process)
    process.send_signal(number)
    errors = process.communicate(timeout=DEADLINE)[1]
    assert process.returncode == 130
    assert errors.endswith('lesson: interrupted\n') and 'Traceback' not in errors
    assert len(ids) == 3
    assert not any(os.path.exists(f'/proc/{pid}') for pid in ids.values())


def test_a_lesson_that_is_killed_takes_its_nodes_along(lesson):
    process, _ = lesson
    ids = children(process)
    process.kill()
    assert len(ids) == 3
    wait_until(lambda: not any(os.path.exists(f'/proc/{pid}') for pid in ids.values()), 'end')


def test_a_second_lesson_on_the_same_topics_is_rejected(lesson, tmp_path):
    process, _ = lesson
    done = run('lesson', *SMALL, '--out', str(tmp_path / 'second'))
    assert done.returncode == 1
    assert done.stderr.endswith(f'lesson: {TAKEN}\n'), done.stderr
    assert not (tmp_path / 'second' / 'learner.log').exists()
    assert process.poll() is None  # the first one goes on


@pytest.mark.long
def test_a_namespace_allows_a_second_lesson(lesson, tmp_path):
    assert_equal_but_for_time(trained_summary(tmp_path / 'a', *SMALL),
                              lesson_summary(tmp_path / 'b', *SMALL, '--namespace', 'second'))


@pytest.mark.parametrize('argv, message', [
    (('--map', 'nowhere'), "lesson: map 'nowhere': a map must be one of"),
    (('--rate', '-1'), 'lesson: argument --rate: it must be 0 or lie in [0.001, 1000], got -1'),
    (('--namespace', '2 b'), 'lesson: argument --namespace: it must be a name that ROS nodes can '
                             "have, got '2 b': "),
])
def test_a_mistake_is_told_before_anything_is_started(tmp_path, argv, message):
    done = run('lesson', *SMALL, *argv, '--out', str(tmp_path))
    assert done.returncode == 2
    assert done.stderr.startswith(message)
    assert done.stderr.count('\n') == 1
    assert not any(tmp_path.iterdir())


def test_of_a_lesson_and_a_world_on_its_topics_one_stands_aside(tmp_path):
    with nodes(tmp_path / 'others', grid_world=('-p', 'map:=bar_grid')) as others:
        world = others['grid_world']
        wait_until(log_has(world, 'ready'), 'another world')
        process = subprocess.Popen(
            [sys.executable, '-c', START.format('lesson'), *SMALL, '--rate', '1', '--out',
             str(tmp_path / 'lesson')], stderr=subprocess.PIPE, text=True)  # two minutes
        try:
            wait_until(lambda: process.poll() is not None or 'inactive: another world, '
                       "'bar_grid', came first" in world.log.read_text(), 'one stands aside')
            if process.poll() is None:  # it had an action first, since they found each other late
                own = tmp_path / 'lesson' / 'grid_world.log'
                assert 'inactive: another world' not in own.read_text()
                return
        finally:
            process.terminate()
            errors = process.communicate(timeout=DEADLINE)[1]
    assert process.returncode == 1
    assert any(sentence in errors for sentence in (
        f'lesson: {TAKEN}\n', "lesson: grid_world inactive: another world, 'bar_grid', came first "
        'and owns these topics')), errors
    assert not (tmp_path / 'lesson' / 'summary.json').exists()


def test_a_lesson_has_its_golden_digest(tmp_path):
    summary = lesson_summary(tmp_path, *GOLDEN['arguments'])
    assert summary['digest'] == GOLDEN['digest'], CHANGED.format('a lesson', summary['digest'])
