# SPDX-License-Identifier: Apache-2.0
"""World, mentor and learner by messages, in any order: the bits of the compiled loop."""

from dataclasses import replace
import random

from actor_network import ShuffledNetwork
from bar_grid_training import PRESETS
import pytest
from tiny_worlds import grid

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.mentor.mentor_policies import noisy_policy, sparse_policy
from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.messages import Episode, Progress
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy


@pytest.mark.parametrize('profile, name', PRESETS)
def test_any_order_and_repetition_gives_the_bits_of_the_compiled_loop(profile, name):
    remembers_advice = len(name) % 2 == 0
    bar = read_map('bar_grid', profile)
    policy = noisy_policy(World(bar), 0.3, random_streams(8)[0])
    config = replace(find_method(name, profile), episodes=3, iterations=3)
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
    assert len(episodes) == 9
    assert sum(msg.steps for msg in episodes) == progress[-1].steps
    assert all(msg.terminated != msg.truncated for msg in episodes)


@pytest.mark.parametrize('mode, remembers_advice', [
    ('early', True), ('early', False), ('important', True), ('important', False),
    ('mistakes', False)])
@pytest.mark.parametrize('shuffle', range(3))
def test_a_mentor_with_a_budget_recommends_the_same_in_any_order(mode, remembers_advice, shuffle):
    bar = read_map('bar_grid', 'published')
    policy = sparse_policy(noisy_policy(World(bar), 0.3, random_streams(8)[0]), World(bar), 0.8, 2)
    config = replace(find_method('explicit', 'published'), episodes=3, iterations=3)
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
