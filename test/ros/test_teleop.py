# SPDX-License-Identifier: Apache-2.0
"""The human mentor at a terminal, here a pseudo-terminal of the test."""

import re
import signal
import termios

from node_processes import nodes, run
from pty_session import pty_session
import pytest
from ros_client import ros_client
from waiting import wait_until

from comply_ros.nodes.topics import ACTION, MENTOR_POLICY, STATE
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World

pytestmark = pytest.mark.usefixtures('domain')
WORLD = ('-p', 'map:=free_grid', '-p', 'seed:=3')
FREE = World(read_map('free_grid', 'published'))
CORRIDOR = """\
intended: 1.0
step_limit: 50
rewards: {step: -0.1, obstacle: -5.0, goal: 1.0}
starts: [[0, 0]]
rows: ['...G']
"""
LEARNER = ('-p', 'iterations:=0', '-p', 'method:=constant', '-p', 'confidence:=1.0', '-p',
           'episodes:=1', '-p', 'map_period:=0.0', '-p', 'remembers_advice:=false')
PATIENT = ('--ros-args', '-p', 'patience:=300.0')


@pytest.fixture
def client(domain):
    """Give a node that receives the messages of the others."""
    with ros_client() as node:
        node.subscribe(STATE, ACTION, MENTOR_POLICY)
        yield node


def until(client, session, condition, what):
    """Spin until the condition is true, and read the terminal meanwhile: it must not fill up."""
    return client.until(lambda: session.read() is not None and condition(), what)


def test_keys_steer_the_robot_and_q_leaves_the_terminal_as_it_was(tmp_path, client):
    received = client.received
    with pty_session(*PATIENT) as session, nodes(tmp_path, grid_world=WORLD, learner=LEARNER):
        for keys in (('\x1b[D', '\x1b[C', '\x1b[B', '\x1b[A'), 'adsw', 'adsw',
                     ('\x1bOD', '\x1bOC', '\x1bOB', '\x1bOA')):
            observation = until(client, session, lambda: received['state'], 'state')[-1]
            session.wait_for(f'step {observation.step} of episode {observation.episode}; '
                             'it waits for you')
            action = int(FREE.available[observation.state].argmax())
            session.type(keys[action])
            until(client, session, lambda answered=observation[:3]: received['action'] and
                  received['action'][-1][:3] == answered, 'action')
            msg = received['action'][-1]
            assert (msg.action, msg.followed) == (action, True)
            until(client, session, lambda last=observation: received['state'][-1] != last,
                  'next state')
        observation = received['state'][-1]
        session.wait_for(f'step {observation.step} of episode {observation.episode}; '
                         'it waits for you')
        session.type(' ')
        session.wait_for('your advice: none')
        session.type('q')
        assert session.end() == (0, True)
        assert session.text.rstrip().endswith('\x1b[?25h\x1b[?1049l')


@pytest.mark.long
def test_an_action_out_of_the_grid_is_rejected_and_the_robot_keeps_waiting(tmp_path, client):
    (tmp_path / 'corridor.yaml').write_text(CORRIDOR)
    world = ('-p', f'map:={tmp_path}/corridor.yaml')
    with pty_session(*PATIENT) as session, nodes(tmp_path, grid_world=world, learner=LEARNER):
        session.wait_for('it waits for you')
        session.type('w')
        session.wait_for("an action must not leave the grid, got '^' in state 0 (row 1, column 1)")
        assert not client.received['action']


def test_painted_advice_is_published_without_a_key_and_the_page_shows_the_trust(tmp_path, client):
    with pty_session(*PATIENT, '-p', f'policy_file:={tmp_path}/mine.txt') as session, \
            nodes(tmp_path, grid_world=WORLD, learner=LEARNER):
        session.wait_for('it waits for you')
        session.type('\t')
        session.wait_for('Mode: painting')
        session.wait_for('trust in you: 1.00 here')
        policies = client.received['mentor_policy']
        before = until(client, session, lambda: policies, 'policy')[-1].action
        session.type('\x1b[C' * 12 + '\x1b[B' * 12 + 'w' + '\x1b[D' + 'w')
        session.wait_for('painted up')
        until(client, session, lambda: policies[-1].action.count(3) == 2, 'new policy')
        now = policies[-1].action
        assert [s for s, (a, b) in enumerate(zip(now, before)) if a != b] == [9, 10]
        session.type(' ')
        until(client, session, lambda: policies[-1].action.count(3) == 1, 'new policy')
        wait_until(lambda: re.search(r'advice in 1 state\b', session.page()), 'number of states')
        session.type('o')
        session.wait_for('saved to')
        assert (tmp_path / 'mine.txt').read_text().splitlines()[-1] == '..........^'
        session.type('x')
        session.wait_for('a tenth of the states has random advice now')


def test_keys_before_there_is_a_world_do_no_harm(client):
    with pty_session(*PATIENT) as session:
        session.wait_for('waits for a world')
        session.type('\tw')
        session.wait_for('Mode: painting')
        assert session.process.poll() is None
        session.type('q')
        assert session.end() == (0, True)


def test_the_policy_can_start_as_that_of_a_generated_mentor(tmp_path, client):
    policies = client.received['mentor_policy']
    with pty_session(*PATIENT, '-p', 'mentor:=optimal') as session, \
            nodes(tmp_path, grid_world=WORLD):
        session.wait_for('your policy starts as optimal')
        until(client, session, lambda: policies and policies[-1].action.count(-1) < 5, 'policy')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_leaves_the_terminal_as_it_was(number):
    with pty_session() as session:
        session.wait_for('waits for a world: is a grid_world running?')
        assert termios.tcgetattr(session.terminal) != session.before
        session.process.send_signal(number)
        assert session.end() == (0, True)


@pytest.mark.long
def test_a_wrong_parameter_is_one_line_and_the_terminal_is_as_it_was():
    for argument, sentence in (('mentor:=wise', 'a mentor must be one of'),
                               ('patience:=-1.0', 'parameter patience must lie in [0.05, 3600]')):
        with pty_session('--ros-args', '-p', argument) as session:
            assert session.end() == (2, True)
            line, = [each for each in session.text.splitlines() if 'teleop_mentor: ' in each]
            assert sentence in line
            assert 'Traceback' not in session.text


def test_without_a_terminal_the_error_is_one_line():
    done = run('teleop_mentor')
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == (
        'teleop_mentor: the input must be a terminal, and is none: '
        'run it in a terminal of its own')
