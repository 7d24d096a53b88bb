# SPDX-License-Identifier: Apache-2.0
"""The node `gym_world` as a real process, with a learner. Skipped without Gymnasium."""

from node_processes import log_has, nodes, run
from own_environments import write_environments
import pytest
from sensor_msgs.msg import Image
from short_training import digest_of, received, spin_until
from waiting import wait_until

from comply_ros.nodes.topics import IMAGE, IMAGE_QOS

pytest.importorskip('gymnasium')
pytestmark = pytest.mark.usefixtures('domain')
WORLD = ('-p', 'env:=MountainCar-v0', '-p', 'bins:=[8, 8]', '-p', 'seed:=3')
LEARNER = ('-p', 'method:=q_learning_epsilon', '-p', 'seed:=3', '-p', 'iterations:=2',
           '-p', 'episodes:=2')


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


@pytest.fixture
def own_envs(tmp_path, monkeypatch):
    """Write environments to a module that nodes can import."""
    write_environments(tmp_path, monkeypatch)


def test_an_exception_of_the_environment_ends_the_node_with_what_it_said(tmp_path, own_envs):
    with nodes(tmp_path, learner=LEARNER):
        done = run('gym_world', '--ros-args', '-p', 'env:=Broken-v0', '-p', 'module:=own_envs')
    assert (done.returncode, done.stderr.splitlines()[-1]) == (1, (
        "gym_world: environment 'Broken-v0' raised RuntimeError in episode 1, step 3: "
        'the motor is off'))


@pytest.mark.parametrize('arguments, message', [
    ((), 'parameter env must be the name of an environment, such as FrozenLake-v1, got none'),
    (('env:=Nowhere-v0',), "environment 'Nowhere-v0' cannot be made: "),
    (('env:=MountainCarContinuous-v0',), "environment 'MountainCarContinuous-v0': the action "
     'space must be Discrete, got Box('),
    (('env:=MountainCar-v0', 'image_rate:=0.0001'), 'parameter image_rate must be 0.0 or at least '
     '0.001, got 0.0001'),
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


class ImageTopic:
    """The topic of the pictures, as `received` takes it."""

    name, message, qos = IMAGE, Image, IMAGE_QOS


DRAWN_WORLD = ('-p', 'env:=Drawn-v0', '-p', 'module:=own_envs', '-p', 'image_rate:=50.0')


def test_pictures_are_drawn_while_somebody_subscribes(tmp_path, own_envs, node):
    learner = ('-p', 'method:=q_learning_epsilon', '-p', 'iterations:=0')
    with nodes(tmp_path / 'nodes', gym_world=(*DRAWN_WORLD, '-p', 'rate:=200.0'),
               learner=learner) as started:
        log = started['gym_world'].log
        wait_until(lambda: log.read_text().count('begins') > 2, 'episodes')
        assert 'draws' not in log.read_text()
        pictures = received(node, ImageTopic)
        spin_until(node, lambda: len({bytes(each.data) for each in pictures}) > 3, 'pictures')
    last = pictures[-1]
    assert (last.height, last.width, last.step, last.encoding) == (2, 3, 9, 'rgb8')
    assert len(last.data) == 18 and set(last.data) == {last.data[0]} <= {*range(41)}
    assert last.header.stamp.sec > 0


def test_a_picture_that_fails_is_said_once_and_the_world_goes_on(tmp_path, own_envs, node):
    world = (*DRAWN_WORLD, '-p', 'env_args:="{display: false}"', '-p', 'rate:=200.0')
    received(node, ImageTopic)
    with nodes(tmp_path / 'nodes', gym_world=world, learner=LEARNER) as started:
        log = started['gym_world'].log
        wait_until(log_has(started['gym_world'], "environment 'Drawn-v0' gives no pictures: no "
                           'display; topic image ends'), 'sentence')
        assert digest_of(started['learner'])
    assert log.read_text().count('draws') == log.read_text().count('no display') == 1


def test_an_environment_that_cannot_be_drawn_is_said(tmp_path):
    world = ('-p', 'env:=comply_ros.environments:comply_ros/BarGrid-v0')
    with nodes(tmp_path, gym_world=world) as started:
        wait_until(log_has(started['gym_world'], 'the environment has no render mode rgb_array, '
                           'so there is no topic image'), 'sentence')
