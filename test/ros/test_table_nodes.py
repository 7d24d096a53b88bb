# SPDX-License-Identifier: Apache-2.0
"""The three nodes and the viewer in a world that is a table: the digest is that of `train`."""

from dataclasses import replace
import time

import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float64
from tiny_tables import machine
from waiting import DEADLINE

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.nodes import grid_world, topics, viewer_messages
from comply_ros.nodes.learner import LearnerNode
from comply_ros.nodes.mentor import MentorNode
from comply_ros.nodes.viewer import ViewerNode
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World
from comply_ros.world.transition_table import Table

ARGUMENTS = ('mentor:mentor:=noisy:0.3', 'learner:method:=explicit', 'learner:iterations:=3',
             'learner:episodes:=4', 'grid_world:seed:=4', 'learner:seed:=4')


@pytest.fixture
def executor(domain, monkeypatch):
    """Return an executor of nodes for which every map is the machine."""
    monkeypatch.setattr(grid_world, 'read_map', lambda name, profile: machine())
    rclpy.init(args=['test', '--ros-args', *(
        word for each in ARGUMENTS for word in ('-p', each))])
    made = SingleThreadedExecutor()
    yield made
    for node in made.get_nodes():
        made.remove_node(node)
        node.destroy_node()
    rclpy.try_shutdown()


def test_nodes_learn_in_a_table_what_one_process_does(executor):
    world = World(machine())
    policy = mentor_policy(read_mentor_spec('noisy:0.3'), world, 0)
    training = Training(world, policy, replace(
        find_method('explicit', 'published'), iterations=3, episodes=4), seed=4)
    for _ in range(3):
        training.iterate()
    listener, maps, returns = Node('listener'), [], []
    read = topics.reader(topics.TRUST)
    listener.create_subscription(topics.TRUST.message, topics.TRUST.name,
                                 lambda content: maps.append(read(content)), topics.LATCHED,
                                 raw=True)
    view = viewer_messages.MEAN_RETURN
    listener.create_subscription(Float64, view.name, returns.append, view.qos)
    nodes = [listener, ViewerNode(), LearnerNode(), MentorNode(), grid_world.GridWorldNode()]
    for node in nodes:
        executor.add_node(node)
    learner, end = nodes[2], time.monotonic() + DEADLINE
    while not (learner.machine.finished and maps and returns):
        assert time.monotonic() < end, 'the learner has not finished'
        executor.spin_once(timeout_sec=0.05)
    assert learner.machine.state.digest() == training.state.digest()
    assert learner.machine.tracker.world.model == 'table'
    assert len(maps[-1].confidence) == 3 and maps[-1].mentor == ''
    assert not any(node.mistake for node in nodes[1:])


def test_a_world_with_too_large_a_description_is_rejected_by_its_node_with_its_size(
        executor, monkeypatch):
    count = 2 ** 15  # states of 40 bytes: first, successor, probability, reward and position
    table = Table(
        actions=('on',), first=np.minimum(np.arange(count + 1), count - 1),
        successor=np.arange(1, count, dtype=np.int32), probability=np.ones(count - 1),
        reward=np.zeros(count - 1), terminal=np.arange(count) == count - 1,
        starts=tuple(range(0, count, 16)), step_limit=9,  # a few sweeps reach all states
        positions=np.zeros((count, 2)))
    monkeypatch.setattr(grid_world, 'read_map', lambda name, profile: table)
    monkeypatch.setattr(topics, 'LARGEST_DESCRIPTION', 2 ** 20)  # a larger world takes seconds
    with pytest.raises(topics.MessageError) as error:
        grid_world.GridWorldNode()
    assert str(error.value) == ('the description of a world must have at most 1 MiB, '
                                f'got {(40 + 4 / 16) * count / 2 ** 20:.1f} MiB')
