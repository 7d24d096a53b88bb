# SPDX-License-Identifier: Apache-2.0
"""`scripts/topic`, for machines without `ros2`."""

import os
import re
import subprocess

from node_processes import log_has, nodes, ROOT, run_tool, tool_command
import pytest
from ros_domain import own_domain
from waiting import DEADLINE, wait_until
import yaml

from comply_ros.protocol.messages import PROTOCOL
from comply_ros.storage.map_files import read_map


@pytest.fixture(scope='module', autouse=True)
def running(tmp_path_factory):
    """Run a world and a learner that never ends."""
    with pytest.MonkeyPatch.context() as monkeypatch, own_domain(monkeypatch), \
            nodes(tmp_path_factory.mktemp('nodes'),
                  grid_world=('-p', 'map:=bar_grid', '-p', 'rate:=200.0'),
                  learner=('-p', 'method:=sarsa', '-p', 'iterations:=0')) as started:
        wait_until(log_has(started['learner'], 'starts to learn'), 'learning')
        yield started


def test_list_names_the_topics():
    ours = {'/world', '/state', '/action', '/episode', '/progress', '/trust', '/policy',
            '/values'}
    wait_until(lambda: ours <= set(run_tool('topic', 'list').stdout.split()), 'topics in the list')
    assert run_tool('topic', 'list').returncode == 0


@pytest.mark.long
def test_info_shows_publishers_and_subscribers_with_their_qos():
    expected = ('Type: comply_msgs/msg/WorldDescription\n\n'
                'Publisher count: 1\n  /grid_world: reliable, transient_local\n\n'
                'Subscription count: 2\n  /grid_world: reliable, transient_local\n'
                '  /learner: reliable, transient_local\n')
    wait_until(lambda: run_tool('topic', 'info', '/world').stdout == expected, 'both nodes')
    assert run_tool('topic', 'info', '/world').returncode == 0


@pytest.mark.long
def test_verbose_info_shows_an_endpoint_as_ros2_does():
    def shown():
        return run_tool('topic', 'info', '-v', '/world').stdout
    wait_until(lambda: 'Subscription count: 2' in shown(), 'both nodes')
    text = shown()
    assert text.startswith('Type: comply_msgs/msg/WorldDescription\n\nPublisher count: 1\n\n'
                           'Node name: grid_world\nNode namespace: /\n'
                           'Topic type: comply_msgs/msg/WorldDescription\n')
    assert text.count('Endpoint type: SUBSCRIPTION') == 2
    assert text.count('QoS profile:\n  Reliability: RELIABLE\n') == 3


def test_echo_shows_latched_messages_as_yaml():
    done = run_tool('topic', 'echo', '--once', 'world')
    assert done.returncode == 0
    msg, = (each for each in yaml.safe_load_all(done.stdout) if each)
    grid = read_map('bar_grid', 'published')
    assert (msg['grid']['rows'], msg['sha256']) == (list(grid.rows), grid.sha256)
    assert msg['starts'] == list(grid.starts) and msg['protocol'] == PROTOCOL
    assert msg['header']['frame_id'] == '' and msg['header']['stamp']['sec'] > 10 ** 9


@pytest.mark.long
def test_echo_cuts_long_arrays_unless_full_length_is_given(tmp_path, domain):
    with nodes(tmp_path, grid_world=(), mentor=('-p', 'mentor:=none')) as started:
        wait_until(log_has(started['mentor'], 'advises'), 'policy')
        cut = run_tool('topic', 'echo', '--once', 'mentor_policy').stdout
        assert cut.count('- -1\n') == 128 and cut.endswith("- -1\n- '...'\n---\n")
        whole = run_tool('topic', 'echo', '--once', '--full-length', 'mentor_policy').stdout
        assert whole.count('- -1\n') == 1681


def test_echo_ends_at_ctrl_c():
    process = subprocess.Popen(tool_command('topic', 'echo', 'episode'), cwd=ROOT,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    lines = [process.stdout.readline() for _ in range(20)]
    process.send_signal(2)
    assert process.communicate(timeout=DEADLINE)[1] == ''
    assert process.returncode == 0
    assert any(line.startswith('total_reward: ') for line in lines)


def test_hz_prints_messages_a_second():
    process = subprocess.Popen(tool_command('topic', 'hz', '/state'), cwd=ROOT,
                               stdout=subprocess.PIPE, text=True)
    line = process.stdout.readline()
    process.send_signal(2)
    process.communicate(timeout=DEADLINE)
    assert float(line.split()[0]) > 1.0
    assert 'messages a second' in line


def test_a_topic_that_does_not_exist_is_named():
    done = run_tool('topic', 'echo', '/nothing', '--timeout', '0.5')
    assert done.returncode == 1
    assert re.match(r"topic: there is no topic '/nothing' in ROS domain \d+; there are /",
                    done.stderr)


def test_a_closed_pipe_ends_echo_although_no_message_follows():
    reader, writer = os.pipe()
    process = subprocess.Popen(tool_command('topic', 'echo', 'world'), cwd=ROOT, stdout=writer,
                               stderr=subprocess.PIPE, text=True)
    os.close(writer)
    assert os.read(reader, 100).startswith(b'header:')
    os.close(reader)
    errors = process.communicate(timeout=DEADLINE)[1]
    assert (process.returncode, errors) == (141, '')
