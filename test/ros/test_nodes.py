# SPDX-License-Identifier: Apache-2.0
"""The three nodes as real processes over real topics."""

from dataclasses import replace
import os
from pathlib import Path
import random
import re
import signal
import time

from comply_msgs.srv import Recommend, Save
from example_nodes import script
from node_processes import log_has, nodes, run
import numpy as np
import pytest
from short_training import (
    digest_of,
    LEARNER,
    MENTOR,
    received,
    SMALL,
    spin_until,
)
from std_srvs.srv import SetBool
from waiting import wait_until

from comply_ros.learner.learner_config import CONFIG_FIELDS
from comply_ros.learner.presets import find_method, METHODS
from comply_ros.learner.training import Training
from comply_ros.nodes import parameters, topics
from comply_ros.storage.map_files import read_map
from comply_ros.storage.map_name import map_names
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World

pytestmark = pytest.mark.usefixtures('domain')


@pytest.mark.parametrize('order', [
    ('learner', 'grid_world', 'mentor'),
    pytest.param(('grid_world', 'mentor', 'learner'), marks=pytest.mark.long),
    pytest.param(('mentor', 'learner', 'grid_world'), marks=pytest.mark.long)], ids='-'.join)
def test_nodes_start_in_any_order(tmp_path, expected, order):
    arguments = {'grid_world': SMALL, 'mentor': MENTOR, 'learner': LEARNER}
    with nodes(tmp_path, **{order[0]: arguments[order[0]]}) as first:
        wait_until(log_has(first[order[0]], 'ready'), 'first node')
        with nodes(tmp_path, **{order[1]: arguments[order[1]]}) as second:
            wait_until(log_has(second[order[1]], 'ready'), 'second node')
            with nodes(tmp_path, **{order[2]: arguments[order[2]]}) as third:
                assert digest_of({**first, **second, **third}['learner']) == expected


@pytest.mark.parametrize('name', [
    pytest.param('grid_world', marks=pytest.mark.long),
    pytest.param('mentor', marks=pytest.mark.long), 'learner'])
def test_ctrl_c_at_any_moment_ends_a_node_cleanly(tmp_path, name):
    moments = random.Random(name).sample(range(0, 1500), 5)
    for number, milliseconds in enumerate(sorted(moments)):
        with nodes(tmp_path / str(number), **{name: ()}) as started:
            process = started[name]
            wait_until(lambda: catches_ctrl_c(process.pid), 'first line of ours')
            begin = time.monotonic()
            wait_until(lambda: time.monotonic() - begin > milliseconds / 1000, 'moment')
            process.interrupt()
            assert process.wait() == 0, (milliseconds, process.log.read_text())
            assert 'Traceback' not in process.log.read_text()


def catches_ctrl_c(pid):
    """Tell whether our own handlers are there: Python itself does not catch SIGTERM."""
    with open(f'/proc/{pid}/status') as status:
        caught = re.search(r'SigCgt:\s*(\w+)', status.read())
    return caught and int(caught[1], 16) & (1 << (signal.SIGTERM - 1))


@pytest.mark.parametrize('number', [
    signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_nodes_end_cleanly_in_the_middle_of_the_learning(tmp_path, node, number):
    actions = received(node, topics.ACTION)
    with nodes(tmp_path, grid_world=SMALL, mentor=MENTOR,
               learner=('-p', 'iterations:=0')) as started:
        spin_until(node, lambda: len(actions) > 200, 'learning')
        for process in started.values():
            os.kill(process.pid, number)
        assert {name: p.wait() for name, p in started.items()} == dict.fromkeys(started, 0)
        for process in started.values():
            assert 'Traceback' not in process.log.read_text()


def test_every_field_of_a_method_is_a_parameter_with_a_description(tmp_path, node):
    from rcl_interfaces.srv import DescribeParameters, ListParameters
    expect = {
        'grid_world': {'map', 'profile', 'seed', 'rate', 'state_dir'},
        'mentor': {'mentor', 'name', 'seed', 'budget', 'advising', 'robots', 'state_dir'},
        'learner': {'method', 'profile', 'seed', 'map_period', 'remembers_advice',
                    'advice_timeout', 'initial_learning', 'end_when_finished', 'state_dir',
                    'mentors', *CONFIG_FIELDS}}
    with nodes(tmp_path, grid_world=(), mentor=(), learner=()):
        for name, names in expect.items():
            listed = call(node, ListParameters, f'/{name}/list_parameters')
            ours = {each for each in listed.result.names if '.' not in each} - {
                each.name for each in parameters.ROS_PARAMETERS}
            assert ours == names
            described = call(node, DescribeParameters, f'/{name}/describe_parameters',
                             names=sorted(ours)).descriptors
            assert all(len(each.description) > 5 for each in described)
            ranged = {each.name for each in described
                      if each.floating_point_range or each.integer_range}
            assert ranged >= {name for name in ours if name in CONFIG_FIELDS
                              and CONFIG_FIELDS[name].metadata['high']}


def call(node, kind, name, **request):
    """Return the response of a service."""
    client = node.create_client(kind, name)
    spin_until(node, client.service_is_ready, f'service {name}')
    future = client.call_async(kind.Request(**request))
    spin_until(node, future.done, f'answer of {name}')
    return future.result()


@pytest.mark.parametrize('name, argument, message', [
    ('learner', 'temperature:=warm',
     "learner: parameter temperature must be a double such as 1.0, got 'warm'"),
    ('learner', 'temperature:=-1.0',
     'learner: parameter temperature must lie in [1e-09, 1000000], got -1.0'),
    ('learner', 'episodes:=1.5', 'learner: parameter episodes must be an integer such as 1, '
     'got 1.5'),
    ('learner', 'method:=sarse', "learner: did you mean 'sarsa'? parameter method must be one of "
     f"{', '.join(METHODS['published'])}, got 'sarse'"),
    ('learner', 'trust:=blind', 'learner: parameter trust must be one of none, scheduled, beta, '
     "explicit, shaping, jump_start, head_start, track_record, returns, got 'blind'"),
    ('learner', 'belief_listen:=-1.0', 'learner: belief_listen and belief_discard must be above 0 '
     'where trust is beta, got -1.0 and 2.0'),
    ('grid_world', 'seed:=-1',
     'grid_world: parameter seed must lie in [0, 9007199254740992], got -1'),
    ('grid_world', 'map:=nowhere', "grid_world: map 'nowhere': a map must be one of "
     f"{', '.join(map_names())}, gym:NAME, nav2:FILE, garnet:SEED or a readable file "
     '(no such file or directory)'),
    ('mentor', 'mentor:=good', 'mentor: a mentor must be one of optimal, random, adversarial, '
     "noisy:P, snapshot:Q, file:PATH, learned:FILE.npz, learner:/NAMESPACE, none, got 'good'"),
])
def test_a_wrong_parameter_is_one_line_and_exit_code_2(name, argument, message):
    done = run(name, '--ros-args', '-p', argument)
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr == message + '\n'


def test_an_argument_that_is_not_for_ros_is_rejected():
    done = run('learner', '-p', 'method:=explicit')
    assert done.returncode == 2
    assert done.stderr == (
        "learner: takes ROS arguments only, got '-p method:=explicit'; parameters are given as "
        '--ros-args -p NAME:=VALUE\n')


@pytest.mark.parametrize('name, what', [
    ('learner', 'waits for a world: is a grid_world running?'),
    pytest.param('mentor', 'waits for a world: is a grid_world running?', marks=pytest.mark.long),
    ('grid_world', 'waits for an action in episode 1, step 0: is a learner running, or has it ')])
def test_a_node_that_waits_logs_for_what(tmp_path, name, what):
    with nodes(tmp_path, **{name: ()}) as started:
        assert wait_until(log_has(started[name], what), what)


def test_a_world_that_waited_for_a_learner_logs_once_that_it_goes_on(tmp_path, node):
    with nodes(tmp_path, grid_world=()) as started:
        wait_until(log_has(started['grid_world'], 'waits for an action'), 'waiting')
        for pauses in (True, False):
            assert call(node, SetBool, '/grid_world/pause', data=pauses).success
            begin = time.monotonic()  # in this time, the node looks once at what it waits for
            wait_until(lambda: time.monotonic() - begin > 1.2, 'a tick')
        assert not log_has(started['grid_world'], 'continues')()
        with nodes(tmp_path / 'learner', learner=('-p', 'method:=q_learning')):
            wait_until(log_has(started['grid_world'], 'continues'), 'continuing')
        assert started['grid_world'].log.read_text().count('continues') == 1


def test_a_world_says_its_step_limit_where_its_map_has_none(tmp_path):
    with nodes(tmp_path, grid_world=('-p', 'map:=cliff_walking')) as started:
        wait_until(log_has(started['grid_world'], 'episodes end after 480 steps at the latest, '
                           'ten times the number of states'), 'a step limit')


@pytest.mark.long
def test_a_world_that_comes_back_while_its_mentor_is_generated_gets_advice(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))
    with nodes(tmp_path, mentor=('-p', 'mentor:=snapshot:0.999')) as started:
        for _ in range(2):
            with nodes(tmp_path / 'world', grid_world=()):
                wait_until(log_has(started['mentor'], 'generates this mentor'), 'generation')
        with nodes(tmp_path / 'world', grid_world=(), learner=('-p', 'iterations:=1')) as others:
            wait_until(log_has(others['learner'], 'finished 1 iterations'), 'learning')
        assert 'Traceback' not in started['mentor'].log.read_text()


def test_learning_goes_on_in_a_world_that_is_killed_and_comes_back(tmp_path):
    with nodes(tmp_path, mentor=MENTOR, learner=LEARNER) as started:
        with nodes(tmp_path / 'first', grid_world=SMALL) as world:
            wait_until(log_has(started['learner'], 'starts to learn'), 'learning')
            os.kill(world['grid_world'].pid, signal.SIGKILL)
        with nodes(tmp_path / 'second', grid_world=SMALL):
            wait_until(log_has(started['learner'], 'continues in world'), 'continuing')
            assert digest_of(started['learner'])


def test_wrong_ros_arguments_are_one_line():
    done = run('learner', '--ros-args', '--params-file', '/nowhere.yaml')
    assert done.returncode == 2
    assert 'learner: the arguments after --ros-args must be known and valid: ' in done.stderr
    assert 'Traceback' not in done.stderr


def test_a_misspelt_method_is_one_line_that_begins_with_the_name_that_was_meant():
    done = run('learner', '--ros-args', '-p', 'method:=beta_implict')
    assert done.returncode == 2
    assert done.stderr.startswith(
        "learner: did you mean 'beta_implicit'? parameter method must be one of sarsa, ")
    assert done.stderr.count('\n') == 1


def test_an_unknown_parameter_is_warned_of(tmp_path):
    with nodes(tmp_path, learner=('-p', 'temprature:=1.0')) as started:
        warning = ("parameter 'temprature' is unknown and has no effect; "
                   "did you mean 'temperature'?")
        assert wait_until(log_has(started['learner'], warning), warning)


def test_a_policy_that_does_not_fit_ends_the_mentor_with_one_line(tmp_path):
    (tmp_path / 'policy.txt').write_text('>>G\n')
    with nodes(tmp_path, grid_world=SMALL,
               mentor=('-p', f'mentor:=file:{tmp_path}/policy.txt')) as started:
        assert wait_until(lambda: started['mentor']._process.poll(), 'end') == 2
        log = started['mentor'].log.read_text()
        assert log.endswith('mentor: a policy must have a row for each of the 11 rows of the '
                             'map, got 1\n')
        assert 'Traceback' not in log


@pytest.mark.long
def test_the_rate_changes_while_the_world_runs(tmp_path, node):
    from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
    from rcl_interfaces.srv import SetParameters

    def set_rate(rate):
        value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=rate)
        return call(node, SetParameters, '/grid_world/set_parameters',
                    parameters=[Parameter(name='rate', value=value)]).results[0]

    def seconds_for(count):  # by the clock of the world: how late they arrive does not count
        already = len(times)
        spin_until(node, lambda: len(times) > already + count, f'{count} states')
        return (times[already + count] - times[already]) / 1e9

    times = []
    node.create_subscription(
        topics.STATE.message, topics.STATE.name,
        lambda message, info: times.append(info['source_timestamp']), topics.STATE.qos)
    with nodes(tmp_path, grid_world=(*SMALL, '-p', 'rate:=20.0'), mentor=MENTOR,
               learner=('-p', 'iterations:=0')):
        spin_until(node, lambda: len(times) > 2, 'states')
        assert seconds_for(20) > 0.5
        assert not set_rate(5000.0).successful
        assert set_rate(0.0).successful
        spin_until(node, lambda: len(times) > 300, 'states at full speed')
        assert set_rate(10.0).successful
        seconds_for(3)
        assert seconds_for(10) > 0.5


@pytest.mark.long
def test_a_namespace_allows_a_second_lesson(tmp_path, expected):
    there = ('-r', '__ns:=/second')
    with nodes(tmp_path / 'a', grid_world=SMALL, mentor=MENTOR, learner=LEARNER) as here, \
            nodes(tmp_path / 'b', grid_world=SMALL + there, mentor=MENTOR + there,
                  learner=(*LEARNER, '-p', 'seed:=4', *there)) as second:
        assert digest_of(here['learner']) == expected
        assert digest_of(second['learner']) != expected


def test_the_mentor_answers_a_service(tmp_path, node):
    world = World(read_map('bar_grid', 'published'))
    policy = mentor_policy(read_mentor_spec('noisy:0.3'), world, 0)
    with nodes(tmp_path, mentor=MENTOR) as started:
        wait_until(log_has(started['mentor'], 'ready'), 'mentor')
        early = call(node, Recommend, 'recommend', state=0)
        assert (early.success, early.action) == (False, -1)
        assert early.message == 'the mentor must have a world and a policy first, and has none yet'
        with nodes(tmp_path, grid_world=SMALL):
            wait_until(log_has(started['mentor'], 'advises'), 'policy')
            for s in (0, 27, 120):
                answer = call(node, Recommend, 'recommend', state=s)
                assert (answer.success, answer.action) == (True, policy[s])
            beyond = call(node, Recommend, 'recommend', state=121)
            assert (beyond.success, beyond.message) == (
                False, 'a state must lie in [0, 120], got 121')


@pytest.mark.long
def test_the_learner_saves_on_request(tmp_path, node, expected):
    with nodes(tmp_path, learner=LEARNER) as started:
        early = call(node, Save, 'save', path=str(tmp_path / 'early.npz'))
        assert (early.success, early.message) == (
            False, 'nothing is learned before a world is known')
        with nodes(tmp_path, grid_world=SMALL, mentor=MENTOR):
            assert digest_of(started['learner']) == expected
        nowhere = call(node, Save, 'save', path='/nowhere/learning.npz')
        assert (nowhere.success, nowhere.message) == (
            False, '/nowhere/learning.npz: no such file or directory')
        saved = call(node, Save, 'save', path=str(tmp_path / 'learning.npz'))
        assert (saved.success, saved.digest) == (True, expected)
        assert (tmp_path / 'learning.npz').exists()


def test_maps_over_all_states_are_published(tmp_path, node):
    trust, policy, advice = (received(node, topic) for topic in (
        topics.TRUST, topics.POLICY, topics.MENTOR_POLICY))
    with nodes(tmp_path, grid_world=SMALL, mentor=MENTOR, learner=LEARNER) as started:
        digest_of(started['learner'])
        spin_until(node, lambda: trust and policy and advice, 'maps')
    world = World(read_map('bar_grid', 'published'))
    expected = mentor_policy(read_mentor_spec('noisy:0.3'), world, 0)
    assert list(advice[-1].action) == expected.tolist()
    assert len(trust[-1].confidence) == len(policy[-1].action) == 121
    assert all(0.0 <= p <= 1.0 for p in trust[-1].confidence)


@pytest.mark.long
def test_invalid_messages_are_rejected_logged_once_and_change_nothing(
        tmp_path, node, expected):
    worlds, states = received(node, topics.WORLD), received(node, topics.STATE)
    with nodes(tmp_path, grid_world=SMALL, learner=LEARNER) as started:
        spin_until(node, lambda: worlds and states, 'an observation')
        wait_until(log_has(started['learner'], 'starts to learn'), 'learner')
        run_id = worlds[-1].run
        state = {'run': run_id, 'episode': 1, 'step': 0}
        for name, topic, wrong, sentence in (
                ('learner', topics.STATE, {'state': 4000}, 'a state must lie in [0, 120], got'),
                ('learner', topics.STATE, {'reward': float('nan')},
                 'a reward must be a finite number, got nan'),
                ('learner', topics.STATE, {'run': run_id ^ 1},
                 f'a state must belong to run {run_id}'),
                ('learner', topics.STATE, {'terminated': True},
                 'terminated must be true at a goal and nowhere else'),
                ('learner', topics.RECOMMENDATION, {'state': 4000},
                 'a recommendation must be for a state in [0, 120]'),
                ('learner', topics.RECOMMENDATION, {'action': 77},
                 'a recommendation must be an action that the state has'),
                ('grid_world', topics.ACTION, {'action': 77},
                 'an action must be one that the state has'),
                ('grid_world', topics.ACTION, {'run': run_id ^ 1},
                 f'an action must belong to run {run_id}'),
                ('grid_world', topics.ACTION, {'episode': 2},
                 'an action must be for step id (1, 0), got (2, 0)')):
            publisher = node.create_publisher(topic.message, topic.name, topic.qos)
            logged = log_has(started[name], f'rejected: {sentence}')

            def publish_until_it_is_logged():
                publisher.publish(topic.message(**{**state, **wrong}))
                return logged()
            wait_until(publish_until_it_is_logged, sentence)
            for _ in range(20):
                publisher.publish(topic.message(**{**state, **wrong}))
            node.destroy_publisher(publisher)
        for name in started:
            log = started[name].log.read_text()
            rejections = re.findall(r'rejected: (\w+ \w+ must \w+ \w+)', log)
            assert len(rejections) == len(set(rejections))
        with nodes(tmp_path, mentor=MENTOR):
            assert digest_of(started['learner']) == expected


def test_the_mentor_node_of_the_pages_can_take_the_place_of_ours(tmp_path):
    page = (Path(__file__).parents[2] / 'docs' / 'how-to' / 'mentor.md').read_text()
    (tmp_path / 'my_mentor.py').write_text(
        re.search(r'```python\n(.*?)```', page, re.DOTALL)[1])
    world = World(read_map('free_grid', 'published'))
    policy = np.where(np.arange(121) % 11 == 10, 3, 1)
    row = replace(find_method('beta_implicit', 'published'), iterations=4, episodes=5)
    training = Training(world, policy, row, 3)
    for _ in range(4):
        training.iterate()
    with script(tmp_path / 'my_mentor.py'), nodes(
            tmp_path, grid_world=('-p', 'map:=free_grid', '-p', 'seed:=3'),
            learner=LEARNER) as started:
        assert digest_of(started['learner']) == training.state.digest()
        assert 'rejected' not in started['learner'].log.read_text()
