# SPDX-License-Identifier: Apache-2.0
"""Real nodes whose `state_dir` is full, removed, cut, of another node or version, or in use."""

from contextlib import contextmanager
from dataclasses import replace
import os
import re
import resource
import shutil
import signal
import subprocess

from node_processes import log_has, nodes, run
import pytest
from ros_domain import own_domain
from waiting import wait_until

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World

pytestmark = pytest.mark.usefixtures('domain')
WORLD = ('-p', 'map:=bar_grid', '-p', 'seed:=3')
MENTOR = ('-p', 'mentor:=noisy:0.3', '-p', 'budget:=40', '-p', 'advising:=mistakes')
LEARNER = ('-p', 'seed:=3', '-p', 'iterations:=8', '-p', 'episodes:=6', '-p',
           'remembers_advice:=false')
NAMES = ('grid_world', 'mentor', 'learner')
ONE_OF_EACH = ('learner', *(pytest.param(name, marks=pytest.mark.long)
                            for name in ('grid_world', 'mentor')))
FULL, ROOM = 'pauses: state_dir', 'state_dir can be written again: continues'


@pytest.fixture(scope='module')
def expected():
    """Return the digest that `train` gives for the arguments above."""
    world = World(read_map('bar_grid', 'published'))
    row = replace(find_method('beta_implicit', 'published'), iterations=8, episodes=6)
    policy = mentor_policy(read_mentor_spec('noisy:0.3'), world, 0)
    training = Training(world, AdviceBudget(world, policy, 40, 'mistakes'), row, 3)
    for _ in range(8):
        training.iterate()
    return training.state.digest()


@contextmanager
def lesson(tmp_path, state=None):
    """Run the three nodes with their state in a folder, one for each by default."""
    states = {name: ('-p', f'state_dir:={state or tmp_path / name}') for name in NAMES}
    arguments = dict(zip(NAMES, (WORLD, MENTOR, LEARNER)))
    with nodes(tmp_path, **{name: arguments[name] + states[name] for name in NAMES}) as started:
        yield started


def digest_of(learner):
    """Return the digest that a learner has logged, as soon as it has."""
    wait_until(log_has(learner, 'finished'), 'end of the learning')
    return re.findall(r'finished 8 iterations, digest (\w{64})', learner.log.read_text())[-1]


def journal_size(folder, name):
    """Return the size of a node's journal, 0 where there is none."""
    return sum(path.stat().st_size for path in folder.glob(f'{name}.*.journal'))


def wait_for_journal(folder, name, size=4000):
    """Wait until a node's journal has grown to a size."""
    wait_until(lambda: journal_size(folder, name) > size, 'journal')


def kill(node):
    """Kill a node with SIGKILL."""
    os.kill(node.pid, signal.SIGKILL)
    node.wait()


def contents(folder):
    """Return name, bytes and time of every file in a folder, but for the locks."""
    return {path.name: (path.read_bytes(), path.stat().st_mtime_ns)
            for path in folder.iterdir() if path.suffix != '.lock'}


@pytest.mark.parametrize('name', ONE_OF_EACH)
def test_a_node_whose_disk_is_full_pauses_and_goes_on_when_there_is_room(
        tmp_path, expected, name):
    with lesson(tmp_path) as started:
        node, folder = started[name], tmp_path / name
        wait_for_journal(folder, name)
        resource.prlimit(node.pid, resource.RLIMIT_FSIZE,
                         (journal_size(folder, name) + 500, resource.RLIM_INFINITY))
        wait_until(log_has(node, FULL), 'full disk')
        sizes = {each: journal_size(tmp_path / each, each) for each in NAMES}
        assert f"state_dir '{folder}' cannot be written (file too large); continues when it can" \
            in node.log.read_text()
        before = len(log_lines(node))
        wait_until(lambda: 'waits for' in ''.join(
            each.log.read_text() for each in started.values()), 'loop that stands still')
        assert {each: journal_size(tmp_path / each, each) for each in NAMES} == sizes
        assert node.log.read_text().count(FULL) == 1
        assert not [line for line in log_lines(node)[before:] if ROOM in line]
        resource.prlimit(node.pid, resource.RLIMIT_FSIZE,
                         (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        wait_until(log_has(node, ROOM), 'room')
        assert digest_of(started['learner']) == expected


def log_lines(node):
    """Return what a node has printed so far, line by line."""
    return node.log.read_text().splitlines()


@pytest.fixture
def tiny_disk(tmp_path):
    """Return a folder on a disk of 64 KB, where this user may make one."""
    folder = tmp_path / 'disk'
    folder.mkdir()
    done = subprocess.run(['mount', '-t', 'tmpfs', '-o', 'size=64k', 'tmpfs', str(folder)],
                          capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f'nobody may mount a tmpfs here: {done.stderr.strip()}')
    yield folder
    subprocess.run(['umount', '-l', str(folder)], check=True)


@pytest.mark.long
def test_a_learner_on_a_full_disk_goes_on_when_there_is_room_and_can_be_killed_there(
        tmp_path, expected, tiny_disk):
    with lesson(tmp_path, tiny_disk) as started:
        wait_until(lambda: any(log_has(node, FULL)() for node in started.values()), 'full disk')
        paused = [node for node in started.values() if log_has(node, FULL)()]
        assert 'cannot be written (no space left on device)' in paused[0].log.read_text()
        kill(started['learner'])
        subprocess.run(['mount', '-o', 'remount,size=8m', str(tiny_disk)], check=True)
        started['learner'].start()
        assert digest_of(started['learner']) == expected


@pytest.mark.parametrize('name', NAMES)
@pytest.mark.long
def test_a_removed_folder_is_made_anew_and_can_be_continued(
        tmp_path, expected, name):
    with lesson(tmp_path) as started:
        node, folder = started[name], tmp_path / name
        wait_for_journal(folder, name)
        os.kill(started['grid_world'].pid, signal.SIGSTOP)
        shutil.rmtree(folder)
        os.kill(started['grid_world'].pid, signal.SIGCONT)
        wait_until(log_has(node, f"state_dir '{folder}' was removed: it is created again"),
                   'log line')
        wait_until(lambda: (folder / f'{name}.checkpoint').exists(), 'checkpoint')
        kill(node)
        node.start()
        assert digest_of(started['learner']) == expected


@pytest.mark.long
def test_a_journal_that_is_cut_in_its_last_record_is_continued(tmp_path):
    with lesson(tmp_path) as started:
        learner, folder = started['learner'], tmp_path / 'learner'
        wait_for_journal(folder, 'learner')
        kill(learner)
        journal, = folder.glob('learner.*.journal')
        os.truncate(journal, journal.stat().st_size - 7)
        learner.start()
        assert digest_of(learner)
        goes_on = re.findall(r'continues (after \d+ steps \(\d+ of them|at step id)',
                             learner.log.read_text())
        assert 1 <= len(goes_on) <= 2  # the second where its last answer was published already
        assert 'Traceback' not in learner.log.read_text()


@pytest.fixture(scope='module')
def stored(tmp_path_factory):
    """Return the folder of nodes that were killed while they learned."""
    folder = tmp_path_factory.mktemp('stored')
    with pytest.MonkeyPatch.context() as monkeypatch, own_domain(monkeypatch), \
            lesson(folder, folder / 'state') as started:
        for name in NAMES:
            wait_for_journal(folder / 'state', name, 1000)
        for node in started.values():
            kill(node)
    return folder / 'state'


@pytest.mark.parametrize('name, changes, reason', [
    ('learner', (*LEARNER, '-p', 'method:=explicit'), "was written with method 'beta_implicit'"),
    ('learner', (*LEARNER, '-p', 'seed:=4'), 'was written with seed 3, but this node has 4'),
    ('grid_world', (*WORLD, '-p', 'map:=maze'), 'was written with map '),
    ('grid_world', (*WORLD, '-p', 'seed:=4'), 'was written with seed 3, but this node has 4')])
def test_the_state_of_other_settings_ends_a_node_with_one_line_and_is_left_untouched(
        stored, name, changes, reason):
    before = contents(stored)
    done = run(name, '--ros-args', *changes, '-p', f'state_dir:={stored}')
    assert done.returncode == 2
    assert reason in one_line(done, name)
    assert contents(stored) == before


def one_line(done, name):
    """Return the line with which a node ended."""
    line, = [each for each in done.stderr.splitlines() if not re.match(r'\[(INFO|WARN)\]', each)]
    assert line.startswith(f'{name}: ')
    return line


@pytest.mark.parametrize('name, arguments', [('grid_world', WORLD), ('learner', LEARNER)])
def test_the_state_of_format_1_ends_a_node_with_one_line_and_is_left_untouched(
        tmp_path, name, arguments):
    (tmp_path / f'{name}.snapshot').write_bytes(b'comply_ros snapshot 1\n')
    before = contents(tmp_path)
    done = run(name, '--ros-args', *arguments, '-p', f'state_dir:={tmp_path}')
    assert done.returncode == 2
    assert one_line(done, name) == (
        f'{name}: {tmp_path}/{name}.snapshot was written by an older version of comply_ros '
        f'(format 1; this one reads format 3): give another state_dir, or move {name}.* away to '
        'start anew')
    assert contents(tmp_path) == before


def test_a_damaged_state_ends_a_node_with_one_line_and_is_left_untouched(stored, tmp_path):
    state = shutil.copytree(stored, tmp_path / 'state')
    for path in (next(state.glob('grid_world.*.journal')), state / 'grid_world.checkpoint'):
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 1
        path.write_bytes(content)
        before = contents(state)
        done = run('grid_world', '--ros-args', *WORLD, '-p', f'state_dir:={state}')
        assert done.returncode == 2
        assert 'as it was written' in one_line(done, 'grid_world')
        assert contents(state) == before


@pytest.mark.long
def test_learned_in_another_world_ends_a_learner_and_leaves_its_state_untouched(stored, tmp_path):
    state = shutil.copytree(stored, tmp_path / 'state')
    before = contents(state)
    with nodes(tmp_path, grid_world=('-p', 'map:=maze')) as started:
        wait_until(log_has(started['grid_world'], 'ready'), 'world')
        done = run('learner', '--ros-args', *LEARNER, '-p', f'state_dir:={state}')
    assert done.returncode == 2
    assert 'has the state of a learner in another world than' in one_line(done, 'learner')
    assert ({name: content for name, (content, _) in contents(state).items()}
            == {name: content for name, (content, _) in before.items()})


def test_the_second_node_with_one_state_dir_ends_with_one_line(tmp_path):
    state = tmp_path / 'state'
    with nodes(tmp_path, grid_world=(*WORLD, '-p', f'state_dir:={state}')) as started:
        wait_until(log_has(started['grid_world'], 'ready'), 'first node')
        done = run('grid_world', '--ros-args', *WORLD, '-p', f'state_dir:={state}')
        assert done.returncode == 2
        assert one_line(done, 'grid_world') == (
            f"grid_world: state_dir '{state}' is in use by another running grid_world: stop that "
            'one, or give this one another state_dir')
