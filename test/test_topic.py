# SPDX-License-Identifier: Apache-2.0
"""`topic`, for machines without `ros2`."""

import re
import subprocess
import sys

from node_processes import log_has, nodes, run, wait_until
import pytest
import yaml

from comply_ros.nodes.node_processes import START
from comply_ros.storage.map_files import read_map

pytestmark = pytest.mark.usefixtures('domain')


@pytest.fixture
def running(tmp_path):
    """Run a world and a learner that never ends."""
    with nodes(tmp_path, grid_world=('-p', 'map:=bar_grid'),
               learner=('-p', 'method:=sarsa', '-p', 'iterations:=0')) as started:
        wait_until(log_has(started['learner'], 'begins to learn'), 'learning')
        yield started


def test_list_names_the_topics(running):
    ours = {'/world', '/state', '/action', '/episode', '/progress', '/trust', '/policy',
            '/values'}
    wait_until(lambda: ours <= set(run('topic', 'list').stdout.split()), 'topics in the list')
    assert run('topic', 'list').returncode == 0


def test_info_names_both_ends_and_their_qos(running):
    expected = ('Type: comply_msgs/msg/WorldDescription\n\n'
                'Publisher count: 1\n  /grid_world: reliable, transient_local\n\n'
                'Subscription count: 2\n  /grid_world: reliable, transient_local\n'
                '  /learner: reliable, transient_local\n')
    wait_until(lambda: run('topic', 'info', '/world').stdout == expected, 'both ends')
    assert run('topic', 'info', '/world').returncode == 0


def test_echo_shows_what_is_latched_as_yaml(running):
    done = run('topic', 'echo', '--once', 'world')
    assert done.returncode == 0
    msg, = (each for each in yaml.safe_load_all(done.stdout) if each)
    grid = read_map('bar_grid', 'published')
    assert (msg['rows'], msg['sha256']) == (list(grid.rows), grid.sha256)
    assert msg['starts'] == list(grid.starts)


def test_echo_cuts_long_arrays_unless_it_is_told_not_to(tmp_path):
    with nodes(tmp_path, grid_world=(), mentor=('-p', 'mentor:=none')) as started:
        wait_until(log_has(started['mentor'], 'advises'), 'policy')
        cut = run('topic', 'echo', '--once', 'mentor_policy').stdout
        assert cut.count('- -1\n') == 128 and cut.endswith("- -1\n- '...'\n---\n")
        whole = run('topic', 'echo', '--once', '--full-length', 'mentor_policy').stdout
        assert whole.count('- -1\n') == 1681


def test_echo_goes_on_until_ctrl_c(running):
    process = subprocess.Popen([sys.executable, '-c', START.format('topic'), 'echo', 'episode'],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    seen = [process.stdout.readline() for _ in range(20)]
    process.send_signal(2)
    assert process.communicate(timeout=20)[1] == ''
    assert process.returncode == 0
    assert any(line.startswith('total_reward: ') for line in seen)


def test_hz_measures(running):
    process = subprocess.Popen([sys.executable, '-c', START.format('topic'), 'hz', '/state'],
                               stdout=subprocess.PIPE, text=True)
    line = process.stdout.readline()
    process.send_signal(2)
    process.communicate(timeout=20)
    assert float(line.split()[0]) > 1.0
    assert 'messages a second' in line


def test_a_topic_that_is_not_there_is_named():
    done = run('topic', 'echo', '/nothing', '--timeout', '0.5')
    assert done.returncode == 1
    assert re.match(r"topic: there is no topic '/nothing' in ROS domain \d+; there are /",
                    done.stderr)
