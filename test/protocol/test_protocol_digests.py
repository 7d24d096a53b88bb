# SPDX-License-Identifier: Apache-2.0
"""World, mentor and learner by messages, in any order: the bits of the compiled loop."""

from dataclasses import replace
from functools import cache
import random

from actor_network import OrderedNetwork, RUN, ShuffledNetwork
from bar_grid_training import PRESETS, use_plain_kernels, use_shared_code
import pytest
from tiny_tables import frozen_lake, hall, machine
from tiny_worlds import grid

from comply_ros.learner.presets import find_method, METHODS
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.mentor.mentor_policies import noisy_policy, sparse_policy
from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Episode, Progress
from comply_ros.protocol.world import WorldMachine
from comply_ros.protocol.world_description import describe_world
from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import MapError
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy
from comply_ros.world.state_action_spaces import Spaces

TABLES = {'machine': machine(), 'lake': frozen_lake(), 'hall': hall(6, 20)}


@cache
def with_policy(name, profile='published'):
    """Return a map of the package or one of the tables, and the policy of a noisy mentor."""
    source = TABLES[name] if name in TABLES else read_map(name, profile)
    return source, noisy_policy(World(source), 0.3, random_streams(8)[0])


@pytest.mark.parametrize('profile, name', PRESETS)
def test_any_order_and_repetition_gives_the_bits_of_a_training_in_one_process(
        monkeypatch, profile, name):
    remembers_advice = len(name) % 2 == 0
    bar, policy = with_policy('bar_grid', profile)
    config = replace(find_method(name, profile), episodes=2, iterations=3)
    use_shared_code(monkeypatch, config)
    training = Training(World(bar), policy, config, seed=4)
    results = [training.iterate() for _ in range(3)]
    network = ShuffledNetwork(config, bar, policy, 4, random.Random(1), remembers_advice).run()
    assert network.learner.state.digest() == training.state.digest()
    progress = [msg for msg in network.reports if isinstance(msg, Progress)]
    assert [msg.mean_return for msg in progress] == [each.mean_return for each in results]
    assert repr([msg.confidence for msg in progress]) == repr(
        [each.confidence for each in results])
    assert [msg.temperature for msg in progress] == [each.temperature for each in results]
    assert progress[-1].steps == sum(each.steps for each in results)
    assert [msg.finished for msg in progress] == [False, False, True]
    episodes = [msg for msg in network.reports if isinstance(msg, Episode)]
    assert len(episodes) == 6
    assert sum(msg.steps for msg in episodes) == progress[-1].steps
    assert all(msg.terminated != msg.truncated for msg in episodes)


def run_in_order(world, config, policy, seed):
    """Return the learner of a whole training in a world, over a network that keeps the order."""
    mentor, learner = Mentor(), Learner(config, seed)
    network = OrderedNetwork(world, mentor, learner)
    network.run(1)
    network.publish(mentor.use(policy))
    network.run()
    assert learner.finished
    return learner


@pytest.mark.parametrize('name', sorted(METHODS['published']))
@pytest.mark.parametrize('table', TABLES)
def test_in_a_table_messages_give_the_bits_of_the_loop(monkeypatch, table, name):
    use_plain_kernels(monkeypatch)  # test_training.py: in any table, they give the compiled bits
    source, policy = with_policy(table)
    config = replace(find_method(name, 'published'), episodes=2, iterations=2)
    training = Training(World(source), policy, config, seed=4)
    for _ in range(2):
        training.iterate()
    learner = run_in_order(WorldMachine(source, 'table', RUN, 4), config, policy, 4)
    assert learner.state.digest() == training.state.digest()


@pytest.mark.parametrize('name', ['sarsa', 'explicit', 'beta_implicit', 'head_start'])
def test_without_a_model_a_learner_learns_the_same_from_the_same_observations(monkeypatch, name):
    use_plain_kernels(monkeypatch)
    table, policy = with_policy('machine')
    config = replace(find_method(name, 'published'), episodes=3, iterations=3)
    training = Training(World(table), policy, config, seed=4)
    for _ in range(3):
        training.iterate()
    robot = WorldMachine(table, 'robot', RUN, 4)
    robot.description = describe_world(
        Spaces(table.n_states, table.actions, table.step_limit, table.available), 'robot', RUN)
    learner = run_in_order(robot, config, policy, 4)
    assert learner.tracker.world.model == 'none'
    assert learner.state.digest() == training.state.digest()


def test_a_world_without_a_model_cannot_move():
    with pytest.raises(MapError, match='a world that moves by actions must have a model'):
        WorldMachine(Spaces(3, ('go',), 10), 'robot', RUN, 4)


@pytest.mark.parametrize('mode, remembers_advice', [
    ('early', True), ('early', False), ('important', True), ('important', False),
    ('mistakes', False)])
@pytest.mark.parametrize('shuffle', range(3))
def test_a_mentor_with_a_budget_recommends_the_same_in_any_order(mode, remembers_advice, shuffle):
    bar, policy = with_policy('bar_grid')
    policy = sparse_policy(policy, World(bar), 0.8, 2)
    config = replace(find_method('explicit', 'published'), episodes=2, iterations=3)
    budget = AdviceBudget(World(bar), policy, 25, mode)
    training = Training(World(bar), budget, config, seed=4)
    results = [training.iterate() for _ in range(3)]
    network = ShuffledNetwork(config, bar, policy, 4, random.Random(shuffle), remembers_advice,
                              25, mode).run()
    assert network.learner.state.digest() == training.state.digest()
    progress = [msg for msg in network.reports if isinstance(msg, Progress)]
    assert repr([msg.confidence for msg in progress]) == repr(
        [each.confidence for each in results])
    assert budget.remaining[0] < 25


@pytest.mark.parametrize('shuffle', range(20))
def test_a_mentor_that_counts_mistakes_waits_for_the_last_action_of_an_episode_too(shuffle):
    tiny = grid('G.#', starts=(1,), limit=30, intended=0.5)
    policy = optimal_policy(World(tiny))
    config = replace(find_method('explicit', 'published'), episodes=3, iterations=3)
    training = Training(World(tiny), AdviceBudget(World(tiny), policy, 3, 'mistakes'), config,
                        seed=4)
    for _ in range(3):
        training.iterate()
    network = ShuffledNetwork(config, tiny, policy, 4, random.Random(shuffle), False, 3,
                              'mistakes').run()
    assert network.learner.state.digest() == training.state.digest()
