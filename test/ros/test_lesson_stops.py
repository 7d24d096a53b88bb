# SPDX-License-Identifier: Apache-2.0
"""Ctrl-Z stops a lesson with its nodes, and `fg` lets all of them go on."""

import os
import signal

from pty_session import pty_session
import pytest
from short_training import children
from waiting import wait_until


def is_stopped(pid):
    """Return whether a process is stopped."""
    with open(f'/proc/{pid}/stat') as file:
        return file.read().rpartition(')')[2].split()[0] == 'T'


@pytest.mark.usefixtures('domain')
@pytest.mark.long
def test_a_lesson_stops_with_its_nodes_and_goes_on(tmp_path):
    with pty_session('--map', 'bar_grid', '--mentor', 'noisy:0.2', '--rate', '40',
                     '--iterations', '4', '--episodes', '5', '--out', str(tmp_path),
                     executable='lesson', columns=60) as session:
        wait_until(lambda: '1/4' in session.read(), 'progress')
        nodes = children(session.process)
        assert len(nodes) == 3
        os.killpg(session.process.pid, signal.SIGTSTP)
        for pid in (session.process.pid, *nodes.values()):
            wait_until(lambda pid=pid: is_stopped(pid), 'stop')
        os.killpg(session.process.pid, signal.SIGCONT)
        code, _ = session.end()
        assert code == 0 and 'summary.json' in session.text
        assert all(len(line) <= 60 for line in session.text.splitlines() if '─' not in line
                   and '/' not in line and '\x1b' not in line)
