# SPDX-License-Identifier: Apache-2.0
"""Processes of nodes that are held before they make their node, and released or ended."""

import os
import subprocess
import sys

from node_processes import log_has
import pytest
from waiting import wait_until

from comply_ros.nodes.node_processes import NodeProcess

pytestmark = pytest.mark.usefixtures('domain')

PARENT = """
import os, time
from comply_ros.nodes.node_processes import NodeProcess
print(NodeProcess('grid_world', (), {folder!r}, held=True).pid, flush=True)
time.sleep(60)
"""


def waits_for_release(pid):
    """Tell whether a process has loaded rclpy, and soon waits."""
    with open(f'/proc/{pid}/maps') as maps:
        return '_rclpy' in maps.read()


def test_a_held_node_starts_when_it_is_released(tmp_path):
    process = NodeProcess('grid_world', (), tmp_path, held=True)
    try:
        wait_until(lambda: waits_for_release(process.pid), 'held process')
        assert process.log.read_text() == ''
        process.release()
        wait_until(log_has(process, 'ready'), 'node')
    finally:
        process.interrupt()
        assert process.wait() == 0


def test_ctrl_c_ends_a_held_process_without_a_word(tmp_path):
    process = NodeProcess('grid_world', (), tmp_path, held=True)
    wait_until(lambda: waits_for_release(process.pid), 'held process')
    process.interrupt()
    assert process.wait() == 0
    assert process.log.read_text() == ''
    process.release()  # too late, and no error


def test_a_held_process_ends_with_its_parent(tmp_path):
    parent = subprocess.Popen([sys.executable, '-c', PARENT.format(folder=str(tmp_path))],
                              stdout=subprocess.PIPE, text=True)
    pid = int(parent.stdout.readline())
    wait_until(lambda: waits_for_release(pid), 'held process')
    parent.kill()
    parent.communicate()
    wait_until(lambda: not os.path.exists(f'/proc/{pid}'), 'end')
    assert (tmp_path / 'grid_world.log').read_text() == ''
