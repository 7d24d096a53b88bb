# SPDX-License-Identifier: Apache-2.0
"""A real mentor node whose person is this test, beside a real world and learner."""

from threading import Event, Thread
import time

from node_processes import DEADLINE, nodes, wait_until
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from ros_client import ros_client

from comply_ros.mentor.mentor_policies import MentorError
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
def person(domain):
    """Return a `HumanMentorNode` that a thread spins."""
    context, ended = rclpy.Context(), Event()
    rclpy.init(context=context)
    node = HumanMentorNode(context=context)
    executor = SingleThreadedExecutor(context=context)  # a second EventsExecutor hears nothing
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
def ask(domain):
    """Return a node that hears the others."""
    with ros_client() as node:
        node.subscribe(STATE, ACTION, MENTOR_POLICY)
        yield node


def done(person, deed):
    """Return what a deed returns in the thread of the node."""
    return person.do(deed).result(DEADLINE)


def know_the_world(person):
    """Wait until the person knows the world."""
    wait_until(lambda: person.policy is not None, 'world')


def test_before_there_is_a_world_a_person_can_do_nothing_and_is_told_so(person, tmp_path):
    assert person.policy is None
    for deed in (lambda: person.paint({0: 1}), person.erase, lambda: person.use(np.zeros(121)),
                 lambda: person.save(tmp_path / 'a.txt'), lambda: person.load('a.txt'),
                 lambda: person.spoil(0.1), lambda: person.begin_from('optimal')):
        with pytest.raises(PolicyError, match='a policy must be for a world, and none is known'):
            done(person, deed)
    assert done(person, lambda: person.steer(1)) is False


def test_what_is_painted_is_followed_from_the_next_question_on_and_published(
        person, ask, tmp_path):
    with nodes(tmp_path, grid_world=WORLD, learner=LEARNER):
        know_the_world(person)
        ask.until(lambda: ask.received['mentor_policy'], 'map')
        assert set(ask.received['mentor_policy'][-1].action) == {-1}
        ask.until(lambda: ask.received['action'], 'action')
        assert not any(each.followed for each in ask.received['action'])
        done(person, lambda: person.use(optimal_policy(BAR)))
        ask.until(lambda: ask.received['mentor_policy'][-1].action.count(-1) < 100, 'map')
        assert list(ask.received['mentor_policy'][-1].action) == optimal_policy(BAR).tolist()
        ask.until(lambda: ask.received['action'][-1].followed, 'trust')
        done(person, person.erase)
        count = len(ask.received['action'])
        ask.until(lambda: len(ask.received['action']) > count + 50, 'actions')
        assert not ask.received['action'][-1].followed


def test_a_drag_over_many_cells_publishes_no_more_than_ten_maps_a_second(person, ask, tmp_path):
    with nodes(tmp_path, grid_world=WORLD):
        know_the_world(person)
        ask.until(lambda: ask.received['mentor_policy'], 'map')
        began, before = time.monotonic(), len(ask.received['mentor_policy'])
        for state in np.flatnonzero(BAR.free)[:60].tolist():
            action = int(BAR.available[state].argmax())
            done(person, lambda state=state, action=action: person.paint({state: action}))
            ask.executor_.spin_once(timeout_sec=0.0)
        ask.until(lambda: list(ask.received['mentor_policy'][-1].action) == person.policy.tolist(),
                  'last map')
        maps = len(ask.received['mentor_policy']) - before
        assert 0 < maps <= 2 + 10 * (time.monotonic() - began)


def test_a_policy_is_saved_loaded_spoiled_and_generated(person, ask, tmp_path):
    with nodes(tmp_path, grid_world=WORLD):
        know_the_world(person)
        used = done(person, lambda: person.begin_from('optimal'))
        used.result(DEADLINE)
        assert (person.policy == optimal_policy(BAR)).all()
        done(person, lambda: person.save(tmp_path / 'mine.txt'))
        done(person, lambda: person.spoil(0.5, seed=1))
        spoiled = (person.policy != optimal_policy(BAR)).sum()
        assert 10 < spoiled < 60
        done(person, lambda: person.load(tmp_path / 'mine.txt'))
        assert (person.policy == optimal_policy(BAR)).all()
        (tmp_path / 'bad.txt').write_text('<<<\n')
        for deed, kind, sentence in (
                (lambda: person.load(tmp_path / 'no.txt'), PolicyError, 'must be readable, got '),
                (lambda: person.load(tmp_path / 'bad.txt'), PolicyError, 'a row for each of the'),
                (lambda: person.save(tmp_path), PolicyError, 'must be written to a file, got '),
                (lambda: person.save(tmp_path / 'no' / 'a'), PolicyError, 'no such file'),
                (lambda: person.save('a\0b'), PolicyError, 'no file can have this name'),
                (lambda: person.spoil(1.5), MentorError, 'a share must lie in'),
                (lambda: person.spoil(float('nan')), MentorError, 'a share must lie in'),
                (lambda: person.begin_from('wise'), MentorError, 'a mentor must be one of')):
            with pytest.raises(kind, match=sentence):
                done(person, deed)
        assert (person.policy == optimal_policy(BAR)).all()


def test_while_steering_the_robot_waits_for_the_person_but_not_for_ever(person, ask, tmp_path):
    with nodes(tmp_path, grid_world=WORLD):
        assert ask.set('mentor', patience=300.0) == ''
        know_the_world(person)
        done(person, lambda: setattr(person, 'steering', True))
        with nodes(tmp_path, learner=LEARNER):
            for _ in range(3):
                waiting = wait_until(lambda: person.actor.waiting, 'question')
                assert 0.0 < wait_until(lambda: person.seconds_left, 'clock') <= 300.0
                action = int(BAR.available[waiting.state].argmax())
                assert done(person, lambda action=action: person.steer(action))
                ask.until(lambda waiting=waiting: ask.received['action'] and
                          ask.received['action'][-1][:3] == waiting[:3], 'action')
                msg = ask.received['action'][-1]
                assert (msg.action, msg.followed) == (action, True)
                assert person.policy[waiting.state] == action
            wait_until(lambda: person.actor.waiting, 'question')
            assert ask.set('mentor', patience=0.05) == ''
            count = len(ask.received['action'])
            ask.until(lambda: len(ask.received['action']) > count + 3, 'actions without a person')
            assert not ask.received['action'][-1].followed
            assert 'out of range' in ask.set('mentor', patience=0.0)
