# SPDX-License-Identifier: Apache-2.0
"""The node `gym_world` as a real process, with a learner. Skipped without Gymnasium."""

import os

from node_processes import log_has, nodes, run
import pytest
from short_training import digest_of
from waiting import wait_until

pytest.importorskip('gymnasium')
pytestmark = pytest.mark.usefixtures('domain')
WORLD = ('-p', 'env:=MountainCar-v0', '-p', 'bins:=[8, 8]', '-p', 'seed:=3')
LEARNER = ('-p', 'method:=q_learning_epsilon', '-p', 'seed:=3', '-p', 'iterations:=2',
           '-p', 'episodes:=2')
BROKEN = """
import gymnasium

class Broken(gymnasium.Env):
    observation_space = gymnasium.spaces.Discrete(3)
    action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        return 0, {}

    def step(self, action):
        raise RuntimeError('the motor is off')

gymnasium.register('Broken-v0', Broken)
"""


def learned(folder, *world):
    """Return the digest of a short learning in the environment."""
    with nodes(folder, gym_world=(*WORLD, *world), learner=LEARNER) as started:
        return digest_of(started['learner'])


def test_a_learner_learns_in_an_environment_and_the_same_seed_gives_the_same_bits(tmp_path):
    assert learned(tmp_path / 'first') == learned(tmp_path / 'second')


@pytest.mark.long
def test_an_environment_that_is_killed_loses_nothing(tmp_path):
    expected = learned(tmp_path / 'whole')
    state = ('-p', f'state_dir:={tmp_path / "state"}')
    with nodes(tmp_path / 'killed', gym_world=(*WORLD, *state, '-p', 'rate:=100.0'),
               learner=LEARNER) as started:
        world = started['gym_world']
        wait_until(log_has(started['learner'], 'starts to learn'), 'learning')
        for count in range(1, 4):
            before = stored(tmp_path / 'state')
            wait_until(lambda before=before: stored(tmp_path / 'state') != before, 'steps')
            world.kill()
            world.wait()
            world.start()
            wait_until(lambda count=count: world.log.read_text().count(
                'continues at step id') == count, 'continuation')
        assert digest_of(started['learner']) == expected


def stored(folder):
    """Return what a node has stored, as the sizes of its files."""
    return {path.name: path.stat().st_size for path in folder.glob('*')}


def test_an_exception_of_the_environment_ends_the_node_with_what_it_said(tmp_path, monkeypatch):
    (tmp_path / 'own_envs.py').write_text(BROKEN)
    monkeypatch.setenv('PYTHONPATH', f'{tmp_path}{os.pathsep}{os.environ.get("PYTHONPATH", "")}')
    with nodes(tmp_path, learner=LEARNER):
        done = run('gym_world', '--ros-args', '-p', 'env:=Broken-v0', '-p', 'module:=own_envs')
    assert (done.returncode, done.stderr.splitlines()[-1]) == (1, (
        "gym_world: environment 'Broken-v0' raised RuntimeError in episode 1, step 1: "
        'the motor is off'))


@pytest.mark.parametrize('arguments, message', [
    ((), 'parameter env must be the name of an environment, such as FrozenLake-v1, got none'),
    (('env:=Nowhere-v0',), "environment 'Nowhere-v0' cannot be made: "),
    (('env:=Taxi-v4', 'module:=no_such_module'), 'parameter module must be a module that can be '
     "imported, got 'no_such_module' (No module named 'no_such_module')"),
    (('env:=Taxi-v4', 'env_args:=[1]'), 'parameter env_args must be '),
    (('env:=MountainCar-v0', "limits:='1,2,3'"), 'parameter limits must be LOW,HIGH of each '
     "dimension, with ';' between two, such as '-1.2,0.6; -0.07,0.07', got '1,2,3'"),
    (('env:=MountainCar-v0', 'bins:=[a]'), 'parameter bins must be a list of integers such as '
     "[40, 40], got ['a']")])
def test_a_mistake_is_one_line_and_exit_code_2(arguments, message):
    done = run('gym_world', '--ros-args', *(word for each in arguments for word in ('-p', each)))
    assert done.returncode == 2
    assert done.stderr.startswith(f'gym_world: {message}') and done.stderr.count('\n') == 1
