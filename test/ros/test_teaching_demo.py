# SPDX-License-Identifier: Apache-2.0
"""`scripts/demo` as a process: its help, and the options that its own messages advise."""

import signal
import subprocess
import sys

from node_processes import run_tool
import pytest
from waiting import DEADLINE, wait_until

from comply_ros.nodes.node_processes import START

pytestmark = pytest.mark.usefixtures('domain')
COMMAND = (sys.executable, '-c', START.format('demo'), '--teach', '--map', 'bar_grid', '--port',
           '0')


@pytest.mark.long
def test_a_second_demo_has_a_namespace_of_its_own(tmp_path):
    demo = subprocess.Popen([*COMMAND, '--namespace', 'two', '--out', str(tmp_path)],
                            stderr=subprocess.PIPE, text=True)
    try:
        wait_until(lambda: {'/two/world', '/two/recommendation', '/two/action'} <= set(
            run_tool('topic', 'list').stdout.split()), 'topics in the namespace')
    finally:
        demo.send_signal(signal.SIGINT)
        errors = demo.communicate(timeout=DEADLINE)[1]
    assert demo.returncode == 0 and 'Traceback' not in errors


def test_a_namespace_that_no_node_can_have_is_one_line(tmp_path):
    done = subprocess.run([*COMMAND, '--namespace', '2', '--out', str(tmp_path)], check=False,
                          capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.startswith('demo --teach: ')
    assert done.stderr.count('\n') == 1


@pytest.mark.parametrize('argv, output', [
    (('--help',), ('usage: demo [-h]', '--teach', '(default: 100)', '(default: runs/demo)')),
    (('--teach', '--help'), ('usage: demo --teach', '--port')),
    (('--help', '--teach'), ('usage: demo --teach', '--port')),
    (('--te', '--help'), ('usage: demo --teach', '--port'))])
def test_the_demo_calls_itself_so_and_has_its_own_defaults(argv, output):
    done = subprocess.run([sys.executable, '-c', START.format('demo'), *argv], check=False,
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert all(each in done.stdout for each in output), done.stdout


def test_a_misspelt_option_of_the_demo_is_an_error_of_the_demo():
    done = subprocess.run([sys.executable, '-c', START.format('demo'), '--tech'], check=False,
                          capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.endswith(
        'demo: unrecognized arguments: --tech; --help shows what there is\n')
