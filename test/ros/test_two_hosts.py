# SPDX-License-Identifier: Apache-2.0
"""World and mentor on one machine, the learner on another, and a cable that can be pulled."""

from contextlib import contextmanager
import subprocess
import sys
import time

from netns_hosts import missing, two_hosts
from node_processes import log_has, nodes
import pytest
from short_training import digest_of, LEARNER, MENTOR, SMALL
from waiting import wait_until

LACK = missing()
needs_two_hosts = pytest.mark.skipif(bool(LACK), reason=LACK or 'all that is needed is here')
RATE = ('-p', 'rate:=100.0')  # 572 steps: six seconds of learning
PULLED = 10.0  # seconds
IN_FLIGHT = 1.0  # seconds after which all messages from before the pull are received and printed
COUNT_ACTIONS = """
import rclpy
from comply_ros.nodes.topics import ACTION
rclpy.init()
node = rclpy.create_node('counter')
node.create_subscription(ACTION.message, ACTION.name, lambda _: print('action', flush=True), 100)
print('subscribed', flush=True)
rclpy.spin(node)
"""


@pytest.fixture
def across_machines(domain, monkeypatch):
    """Let nodes find each other on the network, as the README says for two machines."""
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')


@contextmanager
def counted_actions(folder):
    """Give a function that counts the messages on `action` from now on."""
    path = folder / 'counter.log'
    with path.open('wb') as output:
        counter = subprocess.Popen([sys.executable, '-c', COUNT_ACTIONS], stdout=output,
                                   stderr=subprocess.STDOUT)
    try:
        wait_until(lambda: 'subscribed' in path.read_text(), 'counter of actions')
        yield lambda: path.read_text().count('action\n')
    finally:
        counter.kill()
        counter.wait()


@needs_two_hosts
@pytest.mark.long
def test_a_lesson_goes_on_by_itself_after_the_cable_was_pulled(
        tmp_path, across_machines, expected):  # noqa: F811
    with two_hosts(tmp_path) as (here, there), \
            there.starting_processes(), nodes(tmp_path, learner=LEARNER) as far, \
            counted_actions(tmp_path) as count, \
            here.starting_processes(), nodes(tmp_path, grid_world=SMALL + RATE, mentor=MENTOR):
        wait_until(lambda: count() > 100, 'learning over the cable')
        there.pull_cable()
        time.sleep(IN_FLIGHT)
        before = count()
        time.sleep(PULLED - IN_FLIGHT)
        assert count() == before, 'messages found another way than the cable'
        assert not log_has(far['learner'], 'finished')(), 'the cable was pulled too late'
        there.plug_cable()
        wait_until(lambda: count() > before, 'learning after the cable is in again')
        assert digest_of(far['learner']) == expected


@needs_two_hosts
def test_nothing_is_left_of_two_hosts_after_a_failure(tmp_path):
    with pytest.raises(ZeroDivisionError), two_hosts(tmp_path) as hosts:
        assert {host.namespace for host in hosts} <= namespaces()
        1 / 0
    assert not {host.namespace for host in hosts} & namespaces()


def test_what_two_hosts_need_and_is_missing_is_named(monkeypatch, tmp_path):
    monkeypatch.setenv('PATH', str(tmp_path))
    assert missing() == 'two hosts need the tool `ip`, and there is none: apt install iproute2'
    (tmp_path / 'ip').touch(mode=0o755)
    assert missing(capabilities=0) == (
        'two hosts need CAP_NET_ADMIN and CAP_SYS_ADMIN: be root, outside a container or in a '
        'privileged one')
    assert 'need CAP_SYS_ADMIN:' in missing(capabilities=1 << 12)
    assert missing(capabilities=1 << 12 | 1 << 21) == ''


def namespaces():
    """Names of all network namespaces of this machine."""
    listed = subprocess.run(['ip', 'netns', 'list'], capture_output=True, text=True, check=True)
    return {line.split()[0] for line in listed.stdout.splitlines()}
