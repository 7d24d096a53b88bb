# SPDX-License-Identifier: Apache-2.0
"""A lesson of real nodes, recorded, replayed and drawn."""

import json
import os
import signal
import subprocess
import sys

from nodes import log_has, nodes, run, wait_until
import pytest

from comply_ros.nodes.processes import START

pytestmark = pytest.mark.usefixtures('domain')

SMALL = ('--map', 'bar_grid', '--mentor', 'noisy:0.3', '--iterations', '3', '--episodes', '5')


def test_a_lesson_is_recorded_replayed_and_drawn(tmp_path):
    bag = tmp_path / 'bag'
    with nodes(tmp_path, record=['-p', f'bag:={bag}']) as started:
        wait_until(log_has(started['record'], 'ready'), 'recorder')
        taught = run('lesson', *SMALL, '--out', str(tmp_path / 'lesson'))
        assert taught.returncode == 0, taught.stderr
    log = started['record'].log.read_text()
    assert 'Traceback' not in log and f'messages to {bag} (/world ' in log
    digest = json.loads((tmp_path / 'lesson' / 'summary.json').read_text())['digest']
    proven = run('replay', str(bag))
    assert proven.returncode == 0, proven.stdout + proven.stderr
    assert proven.stdout.startswith('the same: learner ')
    assert proven.stdout.endswith(f', the last {digest}\n')
    assert 'cut off' not in proven.stderr
    pictures = run('plot', str(bag), '--out', str(tmp_path / 'pictures'))
    assert pictures.returncode == 0, pictures.stderr
    assert sorted(os.listdir(tmp_path / 'pictures')) == [
        'episode_lengths.png', 'learning_curve.png', 'trust_map.png']


def test_a_recorder_that_is_killed_leaves_what_it_heard(tmp_path):
    bag = tmp_path / 'bag'
    endless = ['-p', 'iterations:=0']
    with nodes(tmp_path, record=['-p', f'bag:={bag}']) as started:
        wait_until(log_has(started['record'], 'ready'), 'recorder')
        with nodes(tmp_path, grid_world=['-p', 'map:=bar_grid'], mentor=['-p', 'mentor:=optimal'],
                   learner=endless):
            wait_until(lambda: (bag / 'bag.mcap').stat().st_size > 100_000, 'bytes in the file')
            started['record'].kill()
    proven = run('replay', str(bag))
    assert proven.returncode == 0, proven.stdout + proven.stderr
    assert 'its learning had not ended' in proven.stdout
    assert 'bag.mcap has no end after byte' in proven.stderr


def test_a_bag_that_is_there_is_not_touched(tmp_path):
    done = run('record', '--ros-args', '-p', f'bag:={tmp_path}')
    assert done.returncode == 2
    assert done.stderr == ('record: parameter bag must be a folder that is not there yet, got '
                           f'{str(tmp_path)!r}\n')


def test_a_folder_that_cannot_be_made_is_one_sentence():
    done = run('record', '--ros-args', '-p', 'bag:=/proc/bag')
    assert done.returncode == 2
    assert done.stderr.endswith("record: bag '/proc/bag' cannot be written (no such file or "
                                'directory)\n')
    assert 'Traceback' not in done.stderr


def test_ctrl_c_with_nobody_there_ends_a_bag_that_says_so(tmp_path):
    process = subprocess.Popen(
        [sys.executable, '-c', START.format('record'), '--ros-args', '-p',
         f'bag:={tmp_path / "bag"}'], stderr=subprocess.PIPE, text=True)
    wait_until(lambda: (tmp_path / 'bag').exists() or process.poll(), 'bag')
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=30)[1]
    assert process.returncode == 0 and 'Traceback' not in said
    done = run('replay', str(tmp_path / 'bag'))
    assert done.returncode == 2
    assert 'must have a world, and has none among its 0 messages' in done.stderr
