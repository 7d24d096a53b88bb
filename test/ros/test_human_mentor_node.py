# SPDX-License-Identifier: Apache-2.0
"""A human mentor whose person is this test, beside a real world and learner."""

from threading import Event, Thread
import time

from node_processes import nodes
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.time import Time
from ros_client import ros_client
from rosgraph_msgs.msg import Clock
from waiting import DEADLINE, wait_until

from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.mentor.policy_text import PolicyError
from comply_ros.nodes.human_mentor import HumanMentorNode
from comply_ros.nodes.topics import ACTION, MENTOR_POLICY, STATE
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

WORLD = ('-p', 'map:=bar_grid', '-p', 'seed:=3')
LEARNER = ('-p', 'iterations:=0', '-p', 'method:=constant', '-p', 'confidence:=1.0', '-p',
           'remembers_advice:=false')
BAR = World(read_map('bar_grid', 'published'))


@pytest.fixture
def mentor(domain):
    """Return a `HumanMentorNode` that a thread spins."""
    context, ended = rclpy.Context(), Event()
    rclpy.init(context=context)
    node = HumanMentorNode(context=context)
    executor = SingleThreadedExecutor(context=context)  # a second EventsExecutor receives nothing
    executor.add_node(node)

    def spin():
        while not ended.is_set():
            executor.spin_once(timeout_sec=0.1)
    thread = Thread(target=spin)
    thread.start()
    yield node
    ended.set()
    thread.join()
    executor.remove_node(node)
    node.destroy_node()
    rclpy.try_shutdown(context=context)


@pytest.fixture
def client(domain):
    """Return a node that receives what the others publish."""
    with ros_client() as node:
        node.subscribe(STATE, ACTION, MENTOR_POLICY)
        yield node


def call(mentor, function):
    """Return what a function returns in the thread of the node."""
    return mentor.do(function).result(DEADLINE)


def wait_for_world(mentor):
    """Wait until the mentor knows the world."""
    wait_until(lambda: mentor.policy is not None, 'world')


def test_before_there_is_a_world_every_change_raises_an_error(mentor, tmp_path):
    assert mentor.policy is None
    for function in (
            lambda: mentor.paint({0: 1}), mentor.erase, lambda: mentor.use(np.zeros(121)),
            lambda: mentor.save(tmp_path / 'a.txt'), lambda: mentor.load('a.txt'),
            lambda: mentor.spoil(0.1), lambda: mentor.begin_from('optimal')):
        with pytest.raises(PolicyError, match='a policy must be for a world, and none is known'):
            call(mentor, function)
    assert call(mentor, lambda: mentor.steer(1)) is False


def test_a_policy_is_followed_from_the_next_observation_on_and_published(
        mentor, client, tmp_path):
    with nodes(tmp_path, grid_world=WORLD, learner=LEARNER):
        wait_for_world(mentor)
        client.until(lambda: client.received['mentor_policy'], 'map')
        assert set(client.received['mentor_policy'][-1].action) == {-1}
        client.until(lambda: client.received['action'], 'action')
        assert not any(each.followed for each in client.received['action'])
        call(mentor, lambda: mentor.use(optimal_policy(BAR)))
        client.until(lambda: client.received['mentor_policy'][-1].action.count(-1) < 100, 'map')
        assert list(client.received['mentor_policy'][-1].action) == optimal_policy(BAR).tolist()
        client.until(lambda: client.received['action'][-1].followed, 'trust')
        call(mentor, mentor.erase)
        count = len(client.received['action'])
        client.until(lambda: len(client.received['action']) > count + 50, 'actions')
        assert not client.received['action'][-1].followed


@pytest.mark.long
def test_a_drag_over_many_cells_publishes_no_more_than_ten_maps_a_second(mentor, client, tmp_path):
    with nodes(tmp_path, grid_world=WORLD):
        wait_for_world(mentor)
        client.until(lambda: client.received['mentor_policy'], 'map')
        start, before = time.monotonic(), len(client.received['mentor_policy'])
        for state in np.flatnonzero(BAR.free)[:60].tolist():
            action = int(BAR.available[state].argmax())
            call(mentor, lambda state=state, action=action: mentor.paint({state: action}))
            client.executor_.spin_once(timeout_sec=0.0)
        client.until(lambda: list(client.received['mentor_policy'][-1].action)
                     == mentor.policy.tolist(), 'last map')
        maps = len(client.received['mentor_policy']) - before
        assert 0 < maps <= 2 + 10 * (time.monotonic() - start)


def test_a_policy_is_saved_loaded_spoiled_and_generated(mentor, client, tmp_path):
    with nodes(tmp_path, grid_world=WORLD):
        wait_for_world(mentor)
        used = call(mentor, lambda: mentor.begin_from('optimal'))
        used.result(DEADLINE)
        assert (mentor.policy == optimal_policy(BAR)).all()
        call(mentor, lambda: mentor.save(tmp_path / 'mine.txt'))
        call(mentor, lambda: mentor.spoil(0.5, seed=1))
        spoiled = (mentor.policy != optimal_policy(BAR)).sum()
        assert 10 < spoiled < 60
        call(mentor, lambda: mentor.load(tmp_path / 'mine.txt'))
        assert (mentor.policy == optimal_policy(BAR)).all()
        (tmp_path / 'bad.txt').write_text('<<<\n')
        for function, kind, sentence in (
                (lambda: mentor.load(tmp_path / 'no.txt'), PolicyError, 'must be readable, got '),
                (lambda: mentor.load(tmp_path / 'bad.txt'), PolicyError, 'a row for each of the'),
                (lambda: mentor.save(tmp_path), PolicyError, 'must be written to a file, got '),
                (lambda: mentor.save(tmp_path / 'no' / 'a'), PolicyError, 'no such file'),
                (lambda: mentor.save('a\0b'), PolicyError, 'no file can have this name'),
                (lambda: mentor.spoil(1.5), MentorError, 'a share must lie in'),
                (lambda: mentor.spoil(float('nan')), MentorError, 'a share must lie in'),
                (lambda: mentor.begin_from('wise'), MentorError, 'a mentor must be one of')):
            with pytest.raises(kind, match=sentence):
                call(mentor, function)
        assert (mentor.policy == optimal_policy(BAR)).all()


def test_while_steering_the_robot_waits_until_patience_ends(mentor, client, tmp_path):
    with nodes(tmp_path, grid_world=WORLD):
        assert client.set('mentor', patience=300.0) == ''
        wait_for_world(mentor)
        call(mentor, lambda: setattr(mentor, 'steering', True))
        with nodes(tmp_path, learner=LEARNER):
            for _ in range(3):
                waiting = wait_until(lambda: mentor.machine.waiting, 'observation')
                assert 0.0 < wait_until(lambda: mentor.seconds_left, 'clock') <= 300.0
                action = int(BAR.available[waiting.state].argmax())
                assert call(mentor, lambda action=action: mentor.steer(action))
                client.until(lambda waiting=waiting: client.received['action'] and
                             client.received['action'][-1][:3] == waiting[:3], 'action')
                msg = client.received['action'][-1]
                assert (msg.action, msg.followed) == (action, True)
                assert mentor.policy[waiting.state] == action
            wait_until(lambda: mentor.machine.waiting, 'observation')
            assert client.set('mentor', patience=0.05) == ''
            count = len(client.received['action'])
            client.until(lambda: len(client.received['action']) > count + 3,
                         'actions without advice')
            assert not client.received['action'][-1].followed
            assert 'out of range' in client.set('mentor', patience=0.0)


@pytest.mark.long
def test_patience_follows_ros_time_where_use_sim_time_is_set(mentor, client, tmp_path):
    publisher = client.create_publisher(Clock, '/clock', 1)

    def set_ros_time(seconds):
        message = Clock(clock=Time(nanoseconds=round(seconds * 1e9)).to_msg())

        def is_received():
            publisher.publish(message)
            return abs(mentor.get_clock().now().nanoseconds / 1e9 - seconds) < 1e-6
        client.until(is_received, 'time')

    assert client.set('mentor', use_sim_time=True, patience=1.0) == ''
    set_ros_time(100.0)
    call(mentor, lambda: setattr(mentor, 'steering', True))
    with nodes(tmp_path, grid_world=WORLD, learner=LEARNER):
        waiting = wait_until(lambda: mentor.machine.waiting, 'observation')
        wait_until(lambda: mentor.seconds_left == 1.0, 'full patience')
        time.sleep(1.5)
        assert mentor.machine.waiting is waiting and mentor.seconds_left == 1.0
        set_ros_time(101.5)
        client.until(lambda: client.received['action'], 'action without advice')
        assert not client.received['action'][0].followed
