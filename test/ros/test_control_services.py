# SPDX-License-Identifier: Apache-2.0
"""Pause, step, reset and parameters of real nodes: the bits are those of an undisturbed run."""

from dataclasses import replace
import os
import re
import signal

from node_processes import log_has, nodes
import pytest
from ros_client import ros_client
from waiting import wait_until

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.nodes.topics import ACTION, EPISODE, PROGRESS, STATE, TRUST, WORLD
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World

pytestmark = pytest.mark.usefixtures('domain')
ITERATIONS, EPISODES = 3, 3
ARGUMENTS = {
    'grid_world': ('-p', 'map:=bar_grid', '-p', 'seed:=3', '-p', 'rate:=50.0'),
    'mentor': ('-p', 'mentor:=noisy:0.3'),
    'learner': ('-p', 'seed:=3', '-p', f'iterations:={ITERATIONS}', '-p', f'episodes:={EPISODES}')}


@pytest.fixture(scope='module')
def expected():
    """Return the digest that `train` gives for the arguments above."""
    world = World(read_map('bar_grid', 'published'))
    row = replace(find_method('beta_implicit', 'published'), iterations=ITERATIONS,
                  episodes=EPISODES)
    training = Training(world, mentor_policy(read_mentor_spec('noisy:0.3'), world, 0), row, 3)
    for _ in range(ITERATIONS):
        training.iterate()
    return training.state.digest()


@pytest.fixture
def ask(domain):
    """Return a node that calls the others."""
    with ros_client() as node:
        node.subscribe(WORLD, STATE, ACTION, EPISODE, PROGRESS, TRUST)
        yield node


def lesson(tmp_path, **more):
    """Run the three nodes, with more arguments by name."""
    return nodes(tmp_path, **{name: (*arguments, *more.get(name, ()))
                              for name, arguments in ARGUMENTS.items()})


def digests(learner):
    """Return the digests that a learner has logged."""
    return re.findall(r'finished \d+ iterations, digest (\w{64})', learner.log.read_text())


def wait_for_digest(started, ask, count=1):
    """Return the digest at the count-th end of the learning, without waiting for a rate."""
    assert ask.set('grid_world', rate=0.0) == ''
    return wait_until(lambda: digests(started['learner'])[count - 1:], 'end of the learning')[0]


def settle(ask):
    """Wait until the question that was open at a pause is answered."""
    ask.until(lambda: ask.received['state'] and ask.received['action'] and
              ask.received['state'][-1][:3] == ask.received['action'][-1][:3], 'answer')


def step(ask):
    """Let the world ask one question, and wait for its answer."""
    before = ask.received['state'][-1]
    assert ask.trigger('grid_world/step').success
    ask.until(lambda: ask.received['state'][-1] != before, 'question')
    settle(ask)


def test_pauses_and_steps_change_no_bit(tmp_path, ask, expected):
    with lesson(tmp_path) as started:
        ask.until(lambda: ask.received['action'], 'action')
        refused = ask.trigger('grid_world/step')
        assert not refused.success
        assert refused.message == 'a step needs a paused world, and this one runs'
        for _ in range(3):
            paused = ask.pause()
            assert paused.success and paused.message == 'is paused'
            assert ask.pause().success  # idempotent
            settle(ask)
            for _ in range(3):
                step(ask)
            assert ask.pause(False).message == 'runs'
        assert wait_for_digest(started, ask) == expected
        assert 'rejected' not in ''.join(node.log.read_text() for node in started.values())


def test_a_paused_world_says_so_asks_nothing_and_a_step_asks_once(tmp_path, ask):
    with lesson(tmp_path):
        ask.until(lambda: ask.received['state'], 'question')
        ask.pause()
        settle(ask)
        count = len(ask.received['action'])
        ask.until(lambda: ask.statuses.get('grid_world') == 'is paused', 'word')
        assert len(ask.received['action']) == count
        for more in range(1, 4):
            ask.trigger('grid_world/step')
            ask.until(lambda: len(ask.received['action']) >= count + more, 'action')
        ask.statuses.clear()
        ask.until(lambda: ask.statuses.get('grid_world') == 'is paused', 'word')
        assert len(ask.received['action']) == count + 3


def test_after_a_pause_and_two_resets_it_is_a_fresh_start(tmp_path, ask, expected):
    with lesson(tmp_path) as started:
        ask.until(lambda: len(ask.received['progress']) > 0, 'progress')
        ask.pause()
        assert ask.trigger('learner/reset').message == 'nothing is learned'
        assert ask.trigger('grid_world/reset').success
        ask.until(lambda: len(ask.received['world']) > 1, 'new world')
        before, after = ask.received['world'][-2:]
        assert after.replaces == before.run and after.run not in (0, before.run)
        ask.pause(False)
        assert wait_for_digest(started, ask) == expected
        again = ask.until(lambda: [each for each in ask.received['progress']
                                   if each.run == after.run][ITERATIONS - 1:], 'progress')
        assert again[0].finished
        assert 'rejected' not in ''.join(node.log.read_text() for node in started.values())


@pytest.mark.long
def test_a_learner_that_has_finished_learns_again_after_the_resets(tmp_path, ask, expected):
    with lesson(tmp_path) as started:
        assert wait_for_digest(started, ask) == expected
        ask.pause()
        ask.trigger('learner/reset')
        ask.trigger('grid_world/reset')
        ask.pause(False)
        assert wait_for_digest(started, ask, 2) == expected


def test_a_reset_world_keeps_its_new_run_over_a_kill(tmp_path, ask, expected):
    keeps = dict.fromkeys(('grid_world', 'learner'), ('-p', f'state_dir:={tmp_path}'))
    with lesson(tmp_path, **keeps) as started:
        ask.until(lambda: len(ask.received['progress']) > 0, 'progress')
        ask.pause()
        ask.trigger('learner/reset')
        ask.trigger('grid_world/reset')
        run = ask.until(lambda: [each.run for each in ask.received['world'] if each.replaces],
                        'new world')[-1]
        for name in keeps:
            kill(started[name])
            started[name].start()
        assert wait_for_digest(started, ask) == expected
        assert ask.received['world'][-1].run == run


def kill(node):
    """Kill a node as nothing can be killed more suddenly."""
    os.kill(node.pid, signal.SIGKILL)
    node.wait()


def digest_after_change(tmp_path, ask, kills, **changes):
    """Return the digest of a run whose learner's parameters change at one certain question."""
    more = {'learner': ('-p', f'state_dir:={tmp_path}/state', '-p', 'anna.advice_timeout:=1.0')}
    with nodes(tmp_path, **{name: ARGUMENTS[name] for name in ('grid_world', 'mentor')}) as others:
        ask.pause()
        with nodes(tmp_path, learner=(*ARGUMENTS['learner'], *more['learner'])) as started:
            settle(ask)
            for _ in range(20):
                step(ask)
            assert ask.set('learner', **changes) == ''
            if kills:
                kill(started['learner'])
                started['learner'].start()
                wait_until(log_has(started['learner'], 'continues after'), 'learner again')
                for name, value in changes.items():
                    assert ask.get('learner', name) == value
            ask.pause(False)
            digest = wait_for_digest(started, ask)
            assert 'rejected' not in others['grid_world'].log.read_text()
            return digest


@pytest.mark.parametrize('changes', [
    {'learning_rate': 0.25, 'discount': 0.9}, {'trust': 'scheduled', 'confidence': 0.2},
    {'trace_decay': 0.6, 'remembers_advice': False, 'advice_timeout': 30.0,
     'anna.advice_timeout': 20.0}], ids=str)
@pytest.mark.long
def test_a_change_of_parameters_survives_a_kill(tmp_path, expected, changes):
    found = []
    for kills in (False, True):
        with ros_client() as ask:
            ask.subscribe(WORLD, STATE, ACTION)
            found.append(digest_after_change(tmp_path / str(kills), ask, kills, **changes))
    assert found[0] == found[1] != expected


@pytest.mark.parametrize('values, sentence', [
    ({'belief_listen': -1.0}, 'belief_listen and belief_discard must be above 0 where trust is '
                              'beta, got -1.0 and 2.0'),
    ({'trust': 'faith'}, 'trust must be one of none, scheduled,'),
    ({'replays': True}, 'replays must stay false while a learner runs'),
    ({'advice_timeout': float('nan')}, 'advice_timeout out of range'),
    ({'anna.advice_timeout': -1.0}, 'anna.advice_timeout out of range'),
    ({'anna.advice_timeout': float('nan')}, 'anna.advice_timeout out of range'),
    ({'anna.advice_timeout': 'long'}, 'anna.advice_timeout must be a double such as 1.0, got'),
    ({'learning_rate': float('nan')}, 'learning_rate out of range')], ids=str)
def test_a_parameter_that_cannot_be_is_refused_with_one_sentence(tmp_path, ask, values, sentence):
    with nodes(tmp_path, learner=('-p', 'anna.advice_timeout:=1.0')):
        assert sentence in ask.set('learner', **values)
        name, = values
        assert ask.get('learner', name) == ask.get('learner', name) != values[name]


@pytest.mark.long
def test_a_learner_without_a_teacher_hears_one_from_a_change_on(tmp_path, ask):
    with lesson(tmp_path, learner=('-p', 'method:=sarsa', '-p', 'iterations:=0')):
        assert ask.set('grid_world', rate=200.0) == ''
        ask.until(lambda: ask.received['progress'], 'progress')
        assert ask.set('learner', trust='scheduled') == ''
        ask.until(lambda: ask.received['action'][-1].followed, 'trust')
        ask.until(lambda: max(ask.received['trust'][-1].confidence) > 0.0, 'map of trust')
