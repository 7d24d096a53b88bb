# SPDX-License-Identifier: Apache-2.0
"""`teleop_mentor` as any terminal program: its width, NO_COLOR, Ctrl-Z and fg."""

import os
import re
import signal
import termios

from node_processes import nodes
from pty_session import pty_session
import pytest
from waiting import wait_until

pytestmark = pytest.mark.usefixtures('domain')
WORLD = ('-p', 'map:=free_grid', '-p', 'seed:=3')
LEARNER = ('-p', 'iterations:=0', '-p', 'method:=constant', '-p', 'confidence:=1.0', '-p',
           'map_period:=0.0', '-p', 'remembers_advice:=false')
PATIENT = ('--ros-args', '-p', 'patience:=300.0')
HINTS = {'steering': ['arrows, w a s d  where to go', 'space  no advice', 'tab  paint instead',
                      'o  save the policy', 'x  randomize a tenth of it', 'q  quit',
                      'given no advice yet.'],
         'painting': ['arrows  move the cursor', 'w a s d  paint', 'space  erase',
                      'tab  steer instead', 'o  save the policy', 'x  randomize a tenth of it',
                      'q  quit']}
COLOR = re.compile(r'\x1b\[[0-9;]*(38;5|[34][0-7])[0-9;]*m')


@pytest.mark.parametrize('columns', [60, 80])
def test_hints_and_state_are_complete(tmp_path, columns):
    with pty_session(*PATIENT, columns=columns, rows=24) as session, \
            nodes(tmp_path, grid_world=WORLD, learner=LEARNER):
        session.wait_for('robot in state')
        for mode, hints in HINTS.items():
            session.wait_for(f'Mode: {mode}')
            lines = [line.rstrip('\r') for line in session.page().split('\n')]
            assert max(map(len, lines)) <= columns and len(lines) <= 24
            text = ' '.join(line.strip() for line in lines)
            assert [hint for hint in hints if hint not in text] == []
            assert sum('@' in line for line in lines) == 2  # in the title, and on the map
            session.type('\t')


@pytest.mark.parametrize('setting, has_color', [({}, True), ({'NO_COLOR': '1'}, False)])
@pytest.mark.long
def test_no_color_leaves_out_the_colors(tmp_path, setting, has_color):
    with pty_session(*PATIENT, '-p', 'mentor:=optimal', TERM='xterm-256color',
                     **{'NO_COLOR': '', **setting}) as session, \
            nodes(tmp_path, grid_world=WORLD, learner=LEARNER):
        session.wait_for('your policy starts as optimal')
        session.type('\t')  # painting: the policy answers
        session.wait_for('trust in you: 1.00 here')
        assert bool(COLOR.search(session.read())) == has_color


def stopped(process):
    """Tell whether a process is stopped, as by Ctrl-Z."""
    with open(f'/proc/{process.pid}/stat', encoding='utf-8') as file:
        return file.read().rpartition(')')[2].split()[0] == 'T'


@pytest.mark.parametrize('how', ['Ctrl-Z', 'SIGTSTP', 'SIGSTOP'])
@pytest.mark.long
def test_after_a_stop_the_keys_arrive_and_the_end_restores_the_terminal(tmp_path, how):
    with pty_session(*PATIENT) as session, nodes(tmp_path, grid_world=WORLD, learner=LEARNER):
        session.wait_for('it waits for you')
        if how == 'Ctrl-Z':
            session.type('\x1a')
        else:
            session.process.send_signal(signal.Signals[how])
        wait_until(lambda: session.read() and stopped(session.process), 'stop')
        if how != 'SIGSTOP':  # which nothing can prepare for
            assert termios.tcgetattr(session.terminal) == session.before
            assert session.read().endswith('\x1b[?25h\x1b[?1049l')
        termios.tcsetattr(session.terminal, termios.TCSANOW, session.before)  # as shells do
        shown = len(session.read())
        session.process.send_signal(signal.SIGCONT)
        wait_until(lambda: 'Mode: steering' in session.read()[shown:], 'page after fg')
        session.type(' ')
        session.wait_for('your advice: none')
        session.type('q')
        assert session.end() == (0, True)


def test_ctrl_c_ends_it(tmp_path):
    with pty_session(*PATIENT) as session:
        session.wait_for('waits for a world')
        session.type('\x03')
        assert session.end() == (0, True)


def test_escape_sequences_that_are_no_arrows_press_nothing(tmp_path):
    with pty_session(*PATIENT) as session:
        session.wait_for('waits for a world')
        session.type('\x1b[3~\x1b[1;5A\x1bOP')
        session.type('\t')
        session.wait_for('Mode: painting')
        assert 'there is no world yet' not in session.page()
        assert os.isatty(session.terminal)
        session.type('q')
        assert session.end() == (0, True)
