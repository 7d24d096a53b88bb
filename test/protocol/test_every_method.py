# SPDX-License-Identifier: Apache-2.0
"""Every method learns the same from messages as in one process."""

from dataclasses import replace

from actor_network import OrderedNetwork, RUN
from bar_grid_training import PRESETS, use_shared_code
import pytest
from tiny_worlds import grid

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.world import WorldMachine
from comply_ros.protocol.world_description import describe_world
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

ROOM = grid('..#..G', '.#....', '......', limit=30)
ITERATIONS, SEED = 3, 3


@pytest.mark.parametrize('profile, method', PRESETS)
def test_a_training_over_messages_has_the_digest_of_one_in_process(
        monkeypatch, profile, method):
    config = replace(find_method(method, profile), episodes=4, iterations=ITERATIONS)
    use_shared_code(monkeypatch, config)
    advice = optimal_policy(World(ROOM))
    advice[::3] = -1  # a mentor without advice in a third of the states
    mentor = Mentor(0)
    mentor.on_world(describe_world(ROOM, 'room', RUN))
    mentor.use(advice)
    network = OrderedNetwork(WorldMachine(ROOM, 'room', RUN, SEED), mentor, Learner(config, SEED))
    network.run()
    assert network.learner.finished
    training = Training(World(ROOM), advice, config, SEED)
    for _ in range(ITERATIONS):
        training.iterate()
    assert network.learner.state.digest() == training.state.digest()
