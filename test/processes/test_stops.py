# SPDX-License-Identifier: Apache-2.0
"""Ctrl-Z and `fg`: a command stops, gives the cursor back, and goes on."""

import os
import re
import signal

from pty_session import pty_session
from waiting import wait_until

CURSOR_OFF, CURSOR_ON = '\x1b[?25l', '\x1b[?25h'
TRAINING = ('--map', 'bar_grid', '--mentor', 'noisy:0.2', '--iterations', '300000', '--episodes',
            '5', '--out')


def is_stopped(pid):
    """Return whether a process is stopped."""
    with open(f'/proc/{pid}/stat') as file:
        return file.read().rpartition(')')[2].split()[0] == 'T'


def test_train_stops_gives_the_cursor_back_and_goes_on(tmp_path):
    with pty_session(*TRAINING, str(tmp_path), executable='train', columns=60) as session:
        wait_until(lambda: re.search(r'[1-9]\d*/300000', session.read()), 'progress')
        os.killpg(session.process.pid, signal.SIGTSTP)
        wait_until(lambda: is_stopped(session.process.pid), 'stop')
        wait_until(lambda: session.read().rfind(CURSOR_ON) > session.text.rfind(CURSOR_OFF),
                   'cursor')
        shown = len(session.text)
        os.killpg(session.process.pid, signal.SIGCONT)
        wait_until(lambda: CURSOR_OFF in session.read()[shown:], 'hidden cursor')
        wait_until(lambda: '/300000' in session.read()[shown:], 'progress')
        os.killpg(session.process.pid, signal.SIGTSTP)  # a second time
        wait_until(lambda: is_stopped(session.process.pid), 'stop')
        os.killpg(session.process.pid, signal.SIGCONT)
        os.killpg(session.process.pid, signal.SIGINT)
        code, _ = session.end()
        assert code == 130 and session.text.rstrip().endswith('train: interrupted')
