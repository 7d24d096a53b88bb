# SPDX-License-Identifier: Apache-2.0
"""What was learned is used by real nodes: to begin with, to act by, and as a mentor."""

import json
import re

from comply_msgs.srv import Save
from node_processes import log_has, nodes, run
import numpy as np
import pytest
from ros_client import ros_client
from waiting import DEADLINE, wait_until

import comply_ros
from comply_ros.experiments import train
from comply_ros.nodes import topics
from comply_ros.storage.learning_file import read_learning

pytestmark = pytest.mark.usefixtures('domain')
SMALL = ('--map', 'bar_grid', '--iterations', '3', '--episodes', '5')
WORLD = ('-p', 'map:=bar_grid', '-p', 'seed:=3')
LEARNER = ('-p', 'seed:=3', '-p', 'iterations:=3', '-p', 'episodes:=5')


@pytest.fixture(scope='module')
def result():
    """Return what a training has learned on the small map."""
    return comply_ros.train('bar_grid', mentor='noisy:0.3', iterations=20, seed=1)


@pytest.fixture(scope='module')
def file(result, tmp_path_factory):
    """Return the path of the file of that training."""
    return result.save(tmp_path_factory.mktemp('learned')) / 'learning.npz'


def summary_of(folder):
    """Return the summary in a folder, without what differs from clock to clock."""
    summary = json.loads((folder / 'summary.json').read_text())
    return {name: value for name, value in summary.items()
            if name not in ('wall_seconds', 'steps_per_second')}


@pytest.mark.parametrize('argv', [
    ('--mentor', 'noisy:0.3', '--from', '{}'),
    *(pytest.param(argv, marks=pytest.mark.long) for argv in (
        ('--mentor', 'noisy:0.3', '--from', '{}', '--method', 'vanishing'),
        ('--mentor', 'none', '--from', '{}', '--set', 'learns=false'),
        ('--mentor', 'learned:{}', '--method', 'explicit'),
        ('--mentor', 'learned:{}@0.5', '--method', 'policy_shaping', '--budget', '20')))])
def test_a_lesson_gives_the_bits_of_train_and_the_same_file(tmp_path, file, argv):
    argv = [*SMALL, *(each.format(file) for each in argv)]
    assert train.main(['train', *argv, '--out', str(tmp_path / 'train')]) == 0
    done = run('lesson', *argv, '--out', str(tmp_path / 'lesson'), timeout=2 * DEADLINE)
    assert done.returncode == 0, done.stderr
    assert summary_of(tmp_path / 'train') == summary_of(tmp_path / 'lesson')
    one, other = (np.load(tmp_path / name / 'learning.npz') for name in ('train', 'lesson'))
    assert set(one) == set(other)
    for name in one:
        if name != 'settings':
            assert (one[name] == other[name]).all(), name
    assert json.loads(str(one['settings'])) == json.loads(str(other['settings']))


@pytest.mark.long
def test_a_learner_without_learning_acts_by_the_file_for_ever(tmp_path, result, file):
    learner = (*LEARNER[:2], '-p', 'episodes:=5', '-p', 'learns:=false', '-p',
               f'initial_learning:={file}')
    with ros_client() as client, nodes(tmp_path, grid_world=WORLD, learner=learner) as started:
        client.subscribe(topics.POLICY, topics.PROGRESS, topics.STATE, topics.ACTION)
        reports = client.received['progress']
        client.until(lambda: len(reports) > 3 and client.received['policy'], 'iterations')
        assert client.get('learner', 'iterations') == 0
        assert all(not msg.finished for msg in reports)
        assert list(client.received['policy'][-1].action) == result.policy.tolist()
        assert client.set('grid_world', rate=100.0) == ''  # so that none is lost on its way here
        acted = client.until(lambda: actions_by_state(client, result.policy), 'actions')
        assert all(result.policy[s] == action for s, action in acted)
        saved = client.call(Save, 'save', path=str(tmp_path / 'again.npz'))
        assert saved.success
    assert 'and learns nothing' in started['learner'].log.read_text()
    again = read_learning(tmp_path / 'again.npz')
    assert (again.policy == result.policy).all() and (again.state.q == result.q).all()


def actions_by_state(client, policy, count=20):
    """Return state and action where the policy has one, None while there are fewer of them."""
    states = {msg[:3]: msg.state for msg in client.received['state']}
    acted = [(states[msg[:3]], msg.action) for msg in client.received['action']
             if msg.action >= 0 and msg[:3] in states]
    known = [(s, action) for s, action in acted if policy[s] >= 0]
    return known if len(known) >= count else None


def test_a_learner_can_stop_to_learn_while_it_runs(tmp_path):
    learner = ('-p', 'seed:=3', '-p', 'iterations:=0', '-p', 'episodes:=2')
    with ros_client() as client, nodes(tmp_path, grid_world=WORLD, learner=learner,
                                       mentor=('-p', 'mentor:=optimal')):
        client.subscribe(topics.PROGRESS)
        reports = client.received['progress']
        client.until(lambda: len(reports) > 5, 'iterations')
        assert client.set('learner', learns=False) == ''
        first = client.call(Save, 'save', path=str(tmp_path / 'a.npz'))
        count = len(reports)
        client.until(lambda: len(reports) > count + 3, 'iterations without learning')
        second = client.call(Save, 'save', path=str(tmp_path / 'b.npz'))
        assert first.digest == second.digest
        assert client.set('learner', learns=True) == ''
        count = len(reports)
        client.until(lambda: len(reports) > count + 3, 'iterations with learning')
        third = client.call(Save, 'save', path=str(tmp_path / 'c.npz'))
        assert third.digest != second.digest


def test_a_checkpoint_wins_over_the_initial_learning_and_the_log_says_so(tmp_path, file):
    mentor, state = ('-p', 'mentor:=noisy:0.3'), ('-p', f'state_dir:={tmp_path}/state')
    with nodes(tmp_path / 'first', grid_world=WORLD, mentor=mentor,
               learner=(*LEARNER, *state)) as started:
        wait_until(log_has(started['learner'], 'finished 3 iterations'), 'end')
    first = digest_in(started['learner'])
    with nodes(tmp_path / 'second', learner=(
            *LEARNER, *state, '-p', f'initial_learning:={file}')) as started:
        wait_until(log_has(started['learner'], 'finished 3 iterations'), 'end')
        assert 'initial_learning is not used: the checkpoint in state_dir counts more' in \
            started['learner'].log.read_text()
    assert digest_in(started['learner']) == first
    done = run('learner', '--ros-args', *LEARNER, *state, '-p', 'learns:=false')
    assert done.returncode == 2
    assert 'was written with learns True, but this node has False' in done.stderr


def digest_in(learner):
    """Return the digest that a learner has logged."""
    return re.findall(r'digest (\w{64})', learner.log.read_text())[-1]


@pytest.mark.long
def test_a_learner_that_starts_again_goes_on_with_what_it_began_with(tmp_path, file):
    argv = ['--map', 'bar_grid', '--mentor', 'noisy:0.3', '--from', str(file), '--seed', '3',
            '--iterations', '3', '--episodes', '5', '--out', str(tmp_path / 'train')]
    assert train.main(['train', *argv]) == 0
    learner = (*LEARNER, '-p', f'state_dir:={tmp_path}/state', '-p', f'initial_learning:={file}')
    with ros_client() as client, nodes(tmp_path, grid_world=(*WORLD, '-p', 'rate:=10.0'),
                                       mentor=('-p', 'mentor:=noisy:0.3')):
        client.subscribe(topics.ACTION)
        with nodes(tmp_path / 'first', learner=learner):
            client.until(lambda: len(client.received['action']) > 20, 'actions')
        assert client.set('grid_world', rate=0.0) == ''
        with nodes(tmp_path / 'second', learner=learner) as started:
            wait_until(log_has(started['learner'], 'finished 3 iterations'), 'end')
    assert 'continues after' in started['learner'].log.read_text()
    assert digest_in(started['learner']) == summary_of(tmp_path / 'train')['digest']


@pytest.mark.long
def test_a_reset_returns_to_the_initial_learning(tmp_path, result, file):
    learner = ('-p', 'iterations:=0', '-p', f'initial_learning:={file}', '-p', 'episodes:=1')
    with ros_client() as client, nodes(
            tmp_path, grid_world=WORLD, mentor=('-p', 'mentor:=noisy:0.3'), learner=learner):
        client.subscribe(topics.PROGRESS)
        client.until(lambda: len(client.received['progress']) > 3, 'iterations')
        assert client.pause().success
        response = client.trigger('learner/reset')
        assert response.success and response.message == (
            f"it begins again with the learning file '{file}'")
        assert client.call(Save, 'save', path=str(tmp_path / 'a.npz')).success
    assert (read_learning(tmp_path / 'a.npz').state.q == result.q).all()


@pytest.mark.parametrize(('name', 'parameter'), [
    ('learner', 'initial_learning:={}'), ('mentor', 'mentor:=learned:{}')])
@pytest.mark.long
def test_a_file_of_another_world_ends_a_node_with_one_line(tmp_path, file, name, parameter):
    with nodes(tmp_path, grid_world=('-p', 'map:=free_grid')) as started:
        wait_until(log_has(started['grid_world'], 'ready'), 'world')
        done = run(name, '--ros-args', '-p', parameter.format(file))
    assert done.returncode == 2
    line, = [each for each in done.stderr.splitlines() if not re.match(r'\[(INFO|WARN)\]', each)]
    assert line.startswith(f'{name}: the learning file')
    assert 'was learned in another world' in line


@pytest.mark.parametrize(('name', 'parameter'), [
    ('learner', 'initial_learning:={}'), ('mentor', 'mentor:=learned:{}')])
def test_a_bad_file_ends_a_node_with_one_line(tmp_path, name, parameter):
    (tmp_path / 'bad.npz').write_bytes(b'PK\3\4 and no more')
    for path in ('bad.npz', 'missing.npz'):
        done = run(name, '--ros-args', '-p', parameter.format(tmp_path / path))
        assert done.returncode == 2
        line, = done.stderr.splitlines()
        assert line.startswith(f'{name}: a learning file must be ')
