# SPDX-License-Identifier: Apache-2.0
"""A lesson of real nodes, recorded, replayed and drawn."""

from contextlib import contextmanager, ExitStack
import json
import os
from pathlib import Path
import re
import signal
import subprocess
import sys

from node_processes import log_has, nodes, run
import pytest
from ros_client import ros_client
from waiting import DEADLINE, wait_until

from comply_ros.bags.bag_reader import Bag
from comply_ros.experiments import train
from comply_ros.nodes.node_processes import START
from comply_ros.nodes.viewer_messages import VIEWS

pytestmark = pytest.mark.usefixtures('domain')

WORLD, MENTOR = ('-p', 'map:=bar_grid'), ('-p', 'mentor:=noisy:0.3')
SMALL = ('--map', 'bar_grid', '--mentor', 'noisy:0.3', '--iterations', '3', '--episodes', '5')


@contextmanager
def recorded(folder, *learner, rate=300.0):
    """Run the three nodes with a recorder from the start on; give all by name."""
    with nodes(folder, record=['-p', f'bag:={folder / "bag"}'], mentor=MENTOR,
               grid_world=(*WORLD, '-p', f'rate:={rate}')) as started:
        log = started['record']
        for name in ('state', 'mentor_policy'):
            wait_until(log_has(log, f'receives /{name}'), f'recorder of {name}')
        with ros_client() as client:
            assert client.pause().success
            with nodes(folder, learner=learner) as others:
                for name in ('method', 'action'):
                    wait_until(log_has(log, f'receives /{name}'), f'recorder of {name}')
                assert client.pause(False).success
                yield {**started, **others}


def test_a_lesson_is_recorded_replayed_and_plotted(tmp_path):
    assert train.main(['train', *SMALL, '--out', str(tmp_path / 'train')]) == 0
    digest = json.loads((tmp_path / 'train' / 'summary.json').read_text())['digest']
    bag = tmp_path / 'bag'
    with recorded(tmp_path, '-p', 'iterations:=3', '-p', 'episodes:=5') as started:
        wait_until(lambda: f', the last {digest}' in run('replay', str(bag)).stdout, 'proof')
    log = started['record'].log.read_text()
    assert 'Traceback' not in log and f'messages to {bag} (/world ' in log
    replayed = run('replay', str(bag))
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr
    assert replayed.stdout.startswith('verified: learner ')
    assert 'had not finished' not in replayed.stdout and 'cut off' not in replayed.stderr
    pictures = run('plot', str(bag), '--out', str(tmp_path / 'pictures'))
    assert pictures.returncode == 0, pictures.stderr
    assert sorted(os.listdir(tmp_path / 'pictures')) == [
        'confidence.png', 'episode_lengths.png', 'learning_curve.png', 'trust_map.png']


@pytest.mark.long
def test_a_lesson_with_several_mentors_is_recorded_and_replayed(tmp_path):
    bag, names = tmp_path / 'bag', ('anna', 'bob')
    with ExitStack() as stack:
        def start(name, **arguments):
            return stack.enter_context(nodes(tmp_path / name, **arguments))
        recorder = start('record', record=['-p', f'bag:={bag}'])['record']
        for name in names:
            start(name, mentor=['-p', f'name:={name}', '-p', 'mentor:=noisy:0.3'])
        start('world', grid_world=(*WORLD, '-p', 'rate:=300.0'))
        for name in names:
            wait_until(log_has(recorder, f'receives /mentors/{name}/mentor_policy'), name)
        learner = start('learner', learner=['-p', 'mentors:=[anna, bob]', '-p', 'iterations:=3',
                                            '-p', 'episodes:=5'])['learner']
        wait_until(log_has(learner, 'digest '), 'end')
        digest = re.search('digest (.{64})', learner.log.read_text())[1]
        wait_until(lambda: f', the last {digest}' in run('replay', str(bag)).stdout, 'proof')
    replayed = run('replay', str(bag))
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr
    assert 'is not in the bag' not in replayed.stdout


@pytest.mark.long
def test_a_recorder_that_is_killed_leaves_what_it_received(tmp_path):
    bag = tmp_path / 'bag'
    with recorded(tmp_path, '-p', 'iterations:=0') as started:
        size = (bag / 'bag.mcap').stat().st_size
        wait_until(lambda: (bag / 'bag.mcap').stat().st_size > size + 30_000, 'more bytes')
        started['record'].kill()
    replayed = run('replay', str(bag))
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr
    assert 'its training had not finished' in replayed.stdout
    assert 'read up to the last complete message' in replayed.stderr, replayed.stderr


@pytest.mark.long
def test_parameters_that_change_and_a_reset_while_it_learns_are_replayed(tmp_path):
    bag, sizes = tmp_path / 'bag' / 'bag.mcap', []

    def grows():
        sizes.append(bag.stat().st_size)
        wait_until(lambda: bag.stat().st_size > sizes[-1] + 20_000, 'more bytes')

    with recorded(tmp_path, '-p', 'iterations:=0') as started, ros_client() as client:
        grows()
        assert client.set('learner', temperature=3.0, learning_rate=0.5) == ''
        grows()
        assert client.trigger('learner/reset').success
        grows()
        started['record'].interrupt()
        assert started['record'].wait() == 0
    replayed = run('replay', str(bag))
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr
    assert replayed.stdout.count('verified: learner ') == 2


@pytest.mark.long
def test_what_the_viewer_shows_is_recorded_and_replay_ignores_it(tmp_path):
    bag = tmp_path / 'bag'
    with recorded(tmp_path, '-p', 'iterations:=0', rate=20.0) as started, nodes(
            tmp_path, viewer=('-p', 'map_rate:=10.0')):
        for name in ('map', 'robot', 'trail', 'mentor', 'places', 'episode_return'):
            wait_until(log_has(started['record'], f'receives /view/{name}'), f'view/{name}')
        started['record'].interrupt()
        assert started['record'].wait() == 0
    assert 'nav_msgs/msg/OccupancyGrid' in {
        each.message_type for each in Bag(str(bag)) if each.topic == '/view/map'}
    replayed = run('replay', str(bag))
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr
    assert 'read up to' not in replayed.stderr
    layout = json.loads((Path(__file__).parents[2] / 'config/teach.foxglove.json').read_text())
    shown = set(re.findall(r'/view/\w+', json.dumps(layout)))
    assert shown <= {f'/view/{view.name.removeprefix("view/")}' for view in VIEWS}


@pytest.mark.long
def test_only_topics_that_match_are_recorded(tmp_path):
    with nodes(tmp_path, record=['-p', f'bag:={tmp_path / "bag"}', '-p',
                                 'topics:=["rosout", "/parameter_e*"]'],
               grid_world=(*WORLD, '-p', 'rate:=100.0')) as started:
        wait_until(log_has(started['record'], 'receives /rosout'), 'log messages')
        with ros_client() as client:
            assert client.set('grid_world', rate=200.0) == ''
        wait_until(log_has(started['record'], 'receives /parameter_events'), 'event')
        assert 'view' not in started['record'].log.read_text()


def test_a_bag_that_exists_is_not_touched(tmp_path):
    done = run('record', '--ros-args', '-p', f'bag:={tmp_path}')
    assert done.returncode == 2
    assert done.stderr == ('record: parameter bag must be a folder that does not exist yet, got '
                           f'{str(tmp_path)!r}\n')


def test_a_folder_that_cannot_be_made_is_one_line():
    done = run('record', '--ros-args', '-p', 'bag:=/proc/bag')
    assert done.returncode == 2
    assert done.stderr.endswith("record: bag '/proc/bag' cannot be written (no such file or "
                                'directory)\n')
    assert 'Traceback' not in done.stderr


def test_ctrl_c_without_any_message_ends_an_empty_bag(tmp_path):
    process = subprocess.Popen(
        [sys.executable, '-c', START.format('record'), '--ros-args', '-p',
         f'bag:={tmp_path / "bag"}'], stderr=subprocess.PIPE, text=True)
    wait_until(lambda: (tmp_path / 'bag').exists() or process.poll(), 'bag')
    process.send_signal(signal.SIGINT)
    errors = process.communicate(timeout=DEADLINE)[1]
    assert process.returncode == 0 and 'Traceback' not in errors
    done = run('replay', str(tmp_path / 'bag'))
    assert done.returncode == 2
    assert 'must have a world, and has none among its 0 messages' in done.stderr
