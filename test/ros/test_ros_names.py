# SPDX-License-Identifier: Apache-2.0
"""Names that a user gives are checked by the rules of ROS, at once."""

from argparse import ArgumentTypeError

from node_processes import run, run_tool
import pytest

from comply_ros.nodes.lesson_processes import ros_namespace

pytestmark = pytest.mark.usefixtures('domain')
RULE = 'it must be a name that ROS nodes can have, got '


@pytest.mark.parametrize('name', [
    '', '/', 'robot', '/robot', 'robot/', 'fleet/robot_2', '_hidden', 'r' * 35, 'r' * 200])
def test_a_namespace_that_nodes_can_have_is_accepted(name):
    assert ros_namespace(name) == name


@pytest.mark.parametrize('name, reason', [
    ('küche', "alphanumerics, '_', or '/'"), ('r' * 35 + '!', "alphanumerics, '_', or '/'"),
    ('two rooms', "alphanumerics, '_', or '/'"), ('٣', "alphanumerics, '_', or '/'"),
    ('~', "alphanumerics, '_', or '/'"), ('2nd', 'starts with a number'),
    ('a//b', "repeated '/'"), ('r' * 230, 'length'), ('r' * 300, 'exceed'), ('r\n', 'alphanum')])
def test_a_namespace_that_nodes_cannot_have_is_rejected_with_the_reason(name, reason):
    with pytest.raises(ArgumentTypeError) as error:
        ros_namespace(name)
    assert str(error.value).startswith(f'{RULE}{name!r}: ') and reason in str(error.value)
    assert '\n' not in str(error.value)


def test_a_lesson_rejects_a_namespace_before_it_starts_a_node(tmp_path):
    done = run('lesson', '--namespace', 'küche', '--out', str(tmp_path))
    assert done.returncode == 2
    assert done.stderr.startswith(f"lesson: argument --namespace: {RULE}'küche': ")


@pytest.mark.parametrize('name', ['küche', 'r' * 250, '2nd', 'a//b', 'two rooms'])
def test_a_topic_that_cannot_be_relayed_is_rejected(name):
    done = run('fault_injector', '--ros-args', '-p', f'topics:=["{name}"]')
    assert done.stderr.startswith('fault_injector: parameter topics') and done.returncode == 2
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize('words', [
    ('topic', 'echo', 'NAME'), ('topic', 'info', 'NAME'),
    ('service', 'call', 'NAME', 'std_srvs/srv/Trigger'),
    ('param', 'list', 'NAME'), ('param', 'get', 'NAME', 'rate')], ids=' '.join)
@pytest.mark.parametrize('name', ['küche', 'r' * 300])
@pytest.mark.long
def test_a_tool_that_looks_for_a_name_says_what_is_wrong(words, name):
    done = run_tool(*(name if word == 'NAME' else word for word in words), '--timeout', '0.1')
    assert done.returncode in (1, 2) and 'Traceback' not in done.stderr
    assert len(done.stderr.splitlines()) == 1 and name in done.stderr
