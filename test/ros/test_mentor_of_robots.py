# SPDX-License-Identifier: Apache-2.0
"""One process as the mentor of several robots: the bits of each alone, budgets, state, errors."""

from contextlib import contextmanager
import os
import signal

from node_processes import log_has
import pytest
from ros_client import ros_client
from short_training import digest_of
from waiting import wait_until

import comply_ros
from comply_ros.mentor.policy_text import format_policy
from comply_ros.nodes.mentor import PoliciesInMaking, validate_robots
from comply_ros.nodes.node_processes import run_nodes
from comply_ros.nodes.parameters import ParameterError
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import read_mentor_spec
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

ROBOTS = ('/robot_1', '/robot_2', '/robot_3')
LEARNER = ('-p', 'method:=explicit', '-p', 'iterations:=6', '-p', 'episodes:=4',
           '-p', 'map_period:=0.0')
MENTOR = ('-p', 'mentor:=noisy:0.5', '-p', 'seed:=7', '-p', 'budget:=40', '-p',
          'robots:=[/robot_2, /robot_3]')


def in_namespace(robot, *arguments):
    """Return the arguments of a node of a robot."""
    return ('-r', f'__ns:={robot}', *arguments)


@contextmanager
def robots(folder, *more, world=()):
    """Run a world and a learner for each robot and one mentor; give the learners and that."""
    arguments, executables = {}, {}
    for seed, robot in enumerate(ROBOTS):
        for kind, values in (('grid_world', ('-p', 'map:=bar_grid', *world)),
                             ('learner', LEARNER)):
            name = f'{kind}_{seed}'
            executables[name] = kind
            arguments[name] = in_namespace(robot, *values, '-p', f'seed:={seed}')
    arguments['mentor'] = in_namespace(ROBOTS[0], *MENTOR, *more)
    with run_nodes(arguments, folder, executables=executables) as started:
        by_name = dict(zip(arguments, started))
        yield [by_name[f'learner_{seed}'] for seed in range(len(ROBOTS))], by_name['mentor']


def expected():
    """Return the digests of the trainings in one process, each with a budget of its own."""
    return [comply_ros.train('bar_grid', 'explicit', 'noisy:0.5', seed=seed, mentor_seed=7,
                             budget=40, iterations=6, episodes=4).digest
            for seed in range(len(ROBOTS))]


@pytest.mark.usefixtures('domain')
def test_each_robot_learns_the_bits_that_it_would_learn_with_a_mentor_of_its_own(tmp_path):
    with robots(tmp_path) as (learners, mentor):
        assert [digest_of(learner) for learner in learners] == expected()
        mentor.check()
        log = mentor.log.read_text()
        for robot in ROBOTS:
            assert log.count(f'[{robot[1:]}.mentor]: advises in world') == 1


@pytest.mark.usefixtures('domain')
@pytest.mark.long
def test_with_a_state_dir_a_kill_of_the_mentor_costs_no_robot_anything(tmp_path):
    state = tmp_path / 'state'
    with robots(tmp_path, '-p', f'state_dir:={state}', world=('-p', 'rate:=200.0')) as (
            learners, mentor):
        wait_until(lambda: len(list(state.glob('*.mentor.checkpoint'))) == 3, 'three states')
        os.kill(mentor.pid, signal.SIGKILL)
        mentor.wait()
        mentor.start()
        assert [digest_of(learner) for learner in learners] == expected()
    assert {path.name for path in state.glob('*.checkpoint')} == {
        f'{robot[1:]}.mentor.checkpoint' for robot in ROBOTS}


@pytest.mark.usefixtures('domain')
def test_robots_that_cannot_be_end_the_mentor_in_a_sentence(tmp_path):
    with run_nodes({'mentor': ('-p', 'robots:=[robot_2]')}, tmp_path) as (mentor,):
        wait_until(log_has(mentor, 'parameter robots must have namespaces such as /robot_2, got '
                           "'robot_2'"), 'the error')
        wait_until(lambda: mentor.end_report() is not None, 'the end')
        assert 'exit code 2' in mentor.end_report()


@pytest.mark.usefixtures('domain')
def test_a_robot_whose_world_the_mentor_is_not_for_costs_the_others_nothing(tmp_path):
    world = World(read_map('bar_grid', 'published'))
    policy = tmp_path / 'policy.txt'
    policy.write_text(format_policy(optimal_policy(world), world))
    arguments = {
        'mentor': in_namespace('/robot_1', '-p', f'mentor:=file:{policy}', '-p',
                               'robots:=[/robot_2]'),
        'maze': in_namespace('/robot_2', '-p', 'map:=maze'),
        'grid_world': in_namespace('/robot_1', '-p', 'map:=bar_grid'),
        'learner': in_namespace('/robot_1', *LEARNER)}
    with run_nodes({name: arguments[name] for name in ('mentor', 'maze')}, tmp_path,
                   executables={'maze': 'grid_world'}) as (mentor, _):
        wait_until(log_has(mentor, 'this node ends, and the others of its process go on'),
                   'the end of one')
        with ros_client() as client:
            publishers = client.get_publishers_info_by_topic
            client.until(lambda: publishers('/robot_1/recommendation'), 'the mentor is found')
            assert not publishers('/robot_2/recommendation')  # so that nobody waits for it
        with run_nodes({name: arguments[name] for name in ('grid_world', 'learner')},
                       tmp_path) as (_, learner):
            assert digest_of(learner) == comply_ros.train(
                'bar_grid', 'explicit', 'optimal', iterations=6, episodes=4).digest
        mentor.check()


@pytest.mark.parametrize('given', [['/robot_2', '/robot_2'], ['/robot_1']])
def test_each_robot_is_another_one(given):
    with pytest.raises(ParameterError) as error:
        validate_robots(given, '/robot_1')
    assert str(error.value) == ('parameter robots must have each robot once, and not the one in '
                                f'the namespace of this node, /robot_1, got {given}')


def test_any_other_robots_can_be_taught():
    validate_robots(['/robot_2', '/site/robot_3', '/'], '/robot_1')
    validate_robots([], '/')


def test_a_policy_is_made_once_for_a_world_and_again_for_another_one():
    making, spec = PoliciesInMaking(), read_mentor_spec('optimal')
    bar, same, free = (World(read_map(name, 'published'))
                       for name in ('bar_grid', 'bar_grid', 'free_grid'))
    first = making.policy(spec, bar, 0)
    assert making.policy(spec, same, 0) is first
    assert making.policy(spec, free, 0) is not first
    assert first.result().tolist() != making.policy(spec, free, 0).result().tolist()
