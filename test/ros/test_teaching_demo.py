# SPDX-License-Identifier: Apache-2.0
"""`scripts/demo --teach` as a process: the options that its own messages advise."""

import signal
import subprocess
import sys

from node_processes import run_tool
import pytest
from waiting import DEADLINE, wait_until

pytestmark = pytest.mark.usefixtures('domain')
COMMAND = (sys.executable, '-m', 'comply_ros.dashboard.teaching_demo', '--map', 'bar_grid',
           '--port', '0')


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
    assert done.returncode == 2 and done.stderr.startswith('demo: ')
    assert done.stderr.count('\n') == 1
