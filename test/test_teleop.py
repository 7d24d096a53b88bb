# SPDX-License-Identifier: Apache-2.0
"""The mentor at a terminal, in a terminal of the test's own."""

import signal
import termios

from node_processes import nodes, run
from pty_session import typist
import pytest
from ros_client import ros_client

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
def ask(domain):
    """Return a node that hears the others."""
    with ros_client() as node:
        node.subscribe(STATE, ACTION, MENTOR_POLICY)
        yield node


def until(ask, person, condition, what):
    """Spin until the condition is true, and look at the page meanwhile: a full one is no page."""
    return ask.until(lambda: person.read() is not None and condition(), what)


def test_keys_steer_the_robot_and_q_leaves_the_terminal_as_it_was(tmp_path, ask):
    with typist(*PATIENT) as person, nodes(tmp_path, grid_world=WORLD, learner=LEARNER):
        for keys in (('\x1b[D', '\x1b[C', '\x1b[B', '\x1b[A'), 'adsw', 'adsw',
                     ('\x1bOD', '\x1bOC', '\x1bOB', '\x1bOA')):
            asked = until(ask, person, lambda: ask.received['state'], 'state')[-1]
            person.sees(f'step {asked.step} of episode {asked.episode}; it waits for you')
            action = int(FREE.available[asked.state].argmax())
            person.type(keys[action])
            until(ask, person, lambda asked=asked: ask.received['action'] and
                      ask.received['action'][-1][:3] == asked[:3], 'answer')
            msg = ask.received['action'][-1]
            assert (msg.action, msg.followed) == (action, True)
            until(ask, person, lambda asked=asked: ask.received['state'][-1] != asked,
                  'next state')
        person.type(' ')
        person.sees('you said no advice')
        person.type('q')
        assert person.end() == (0, True)
        assert person.text.rstrip().endswith('\x1b[?25h\x1b[?1049l')


def test_an_arrow_that_leads_out_is_refused_with_one_sentence_and_the_robot_waits_on(
        tmp_path, ask):
    (tmp_path / 'corridor.yaml').write_text(CORRIDOR)
    world = ('-p', f'map:={tmp_path}/corridor.yaml')
    with typist(*PATIENT) as person, nodes(tmp_path, grid_world=world, learner=LEARNER):
        person.sees('it waits for you')
        person.type('w')
        person.sees("an action must not leave the grid, got '^' in row 1, column 1")
        assert not ask.received['action']


def test_what_is_painted_answers_by_itself_and_the_trust_is_shown(tmp_path, ask):
    with typist(*PATIENT, '-p', f'policy_file:={tmp_path}/mine.txt') as person, \
            nodes(tmp_path, grid_world=WORLD, learner=LEARNER):
        person.sees('it waits for you')
        person.type('\t')
        person.sees('mode: painting')
        person.sees('trust in you: 1.00 here')
        before = until(ask, person, lambda: ask.received['mentor_policy'], 'map')[-1].action
        person.type('\x1b[C' * 12 + '\x1b[B' * 12 + 'w' + '\x1b[D' + 'w')
        person.sees('painted up')
        until(ask, person, lambda: ask.received['mentor_policy'][-1].action.count(3) == 2, 'map')
        now = ask.received['mentor_policy'][-1].action
        assert [s for s, (a, b) in enumerate(zip(now, before)) if a != b] == [9, 10]
        person.type(' ')
        until(ask, person, lambda: ask.received['mentor_policy'][-1].action.count(3) == 1, 'map')
        person.type('o')
        person.sees('saved to')
        assert (tmp_path / 'mine.txt').read_text().splitlines()[-1] == '..........^'
        person.type('x')
        person.sees('a tenth is spoiled')


def test_what_is_painted_before_there_is_a_world_waits_for_one(ask):
    with typist(*PATIENT) as person:
        person.sees('waits for a world')
        person.type('\tw')
        person.sees('mode: painting')
        assert person.process.poll() is None
        person.type('q')
        assert person.end() == (0, True)


def test_a_generated_mentor_is_where_a_person_can_begin(tmp_path, ask):
    with typist(*PATIENT, '-p', 'mentor:=optimal') as person, nodes(tmp_path, grid_world=WORLD):
        person.sees('begins as optimal')
        until(ask, person, lambda: ask.received['mentor_policy'] and
                  ask.received['mentor_policy'][-1].action.count(-1) < 5, 'map')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_leaves_the_terminal_as_it_was(number):
    with typist() as person:
        person.sees('waits for a world: is a grid_world running?')
        assert termios.tcgetattr(person.theirs) != person.before
        person.process.send_signal(number)
        assert person.end() == (0, True)


def test_what_cannot_be_is_said_in_one_line_with_the_terminal_as_it_was():
    for argument, sentence in (('mentor:=wise', 'a mentor must be one of'),
                               ('patience:=-1.0', 'parameter patience must lie in [0.05, 3600]')):
        with typist('--ros-args', '-p', argument) as person:
            assert person.end() == (2, True)
            line, = [each for each in person.text.splitlines() if 'teleop_mentor: ' in each]
            assert sentence in line
            assert 'Traceback' not in person.text


def test_where_there_is_no_terminal_it_says_so_in_one_line():
    done = run('teleop_mentor')
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == (
        'teleop_mentor: the input must be a terminal, for its keys and its page, and is none: '
        'run it in a terminal of its own')
