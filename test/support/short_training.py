# SPDX-License-Identifier: Apache-2.0
"""Three nodes that learn for a second, what they publish, and the digest that they reach."""

from dataclasses import replace
from pathlib import Path
import re
import time

from node_processes import log_has
import rclpy
from waiting import DEADLINE, wait_until

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World

SMALL = ('-p', 'map:=bar_grid', '-p', 'seed:=3')
MENTOR = ('-p', 'mentor:=noisy:0.3')
LEARNER = ('-p', 'seed:=3', '-p', 'iterations:=4', '-p', 'episodes:=5')
DIGEST = r'finished \d+ iterations, digest (\w{64})'


def trained(iterations):
    """Return the digest that `train` gives for the arguments above, and so many iterations."""
    world = World(read_map('bar_grid', 'published'))
    row = replace(find_method('beta_implicit', 'published'), iterations=iterations, episodes=5)
    training = Training(world, mentor_policy(read_mentor_spec('noisy:0.3'), world, 0), row, 3)
    for _ in range(iterations):
        training.iterate()
    return training.state.digest()


def spin_until(node, condition, what, deadline=DEADLINE):
    """Spin the test's node until the condition is true."""
    executor = rclpy.executors.SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    end = time.monotonic() + deadline
    while not condition():
        assert time.monotonic() < end, f'no {what} within {deadline} s'
        executor.spin_once(timeout_sec=0.05)
    executor.remove_node(node)


def received(node, topic):
    """Return the list of messages on a topic from now on."""
    messages = []
    node.create_subscription(topic.message, topic.name, messages.append, topic.qos)
    return messages


def digest_of(learner):
    """Return the digest that a learner logs when it has finished."""
    wait_until(log_has(learner, 'finished'), 'end of the learning')
    return re.search(DIGEST, learner.log.read_text())[1]


def children(process):
    """Return the process ids of the nodes of a lesson, by name."""
    ids = Path(f'/proc/{process.pid}/task/{process.pid}/children').read_text().split()
    return {name: int(pid) for pid in ids for name in ('grid_world', 'mentor', 'learner')
            if f'import {name};' in Path(f'/proc/{pid}/cmdline').read_text()}
