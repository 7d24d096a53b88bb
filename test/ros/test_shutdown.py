# SPDX-License-Identifier: Apache-2.0
"""All nodes of a process are destroyed before rclpy shuts down, however the process ends."""

import subprocess
import sys

from node_processes import run_tool
import pytest

pytestmark = pytest.mark.usefixtures('domain')
PROGRAM = """
from rclpy.exceptions import InvalidHandle
from comply_ros.nodes.parameter_node import SafeParameterNode
from comply_ros.nodes.parameters import ParameterError
from comply_ros.nodes.spin import run_node
nodes = []
def make():
    for name in ('one', 'two', 'three'):
        nodes.append(SafeParameterNode(name))
        nodes[-1].create_service(__import__('std_srvs.srv').srv.Trigger, 'same', print)
    raise ParameterError('parameter of the third')
def is_destroyed(node):
    try:
        with node.handle:
            return False
    except InvalidHandle:
        return True
assert run_node(make, ['test'], (ParameterError,)) == 2
print(*(is_destroyed(node) for node in nodes))
"""


def test_every_node_is_destroyed_where_one_refuses_a_parameter():
    """Those that are left are destroyed in any order when the interpreter ends."""
    done = subprocess.run([sys.executable, '-c', PROGRAM], capture_output=True, text=True,
                          check=False)
    assert (done.stdout.split(), done.stderr.splitlines()) == (
        ['True'] * 3, ['test: parameter of the third'])


@pytest.mark.long
def test_nodes_that_refuse_a_value_end_with_exit_code_2():
    done = run_tool('starts', '--starts', '8')
    assert done.returncode == 0, done.stderr
    assert 'Passed: 8 starts ended with exit code 2.' in done.stdout + done.stderr
