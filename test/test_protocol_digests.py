# SPDX-License-Identifier: Apache-2.0
"""World, mentor and learner at one table, in any order: the bits of the compiled loop."""

from dataclasses import replace
import random

import pytest
from test_presets import ROWS
from tiny_worlds import grid

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.mentor.mentor_policies import noisy_policy, sparse_policy
from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Action, Episode, Progress, Recommendation, StateReward
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

RUN = 7


class Table:
    """
    World, mentor and learner at one table; messages lie on it until somebody takes them up.

    Every message that is said lies there for everybody who listens to it; `shuffle` decides which
    one is taken up next, and which is taken up twice.
    """

    def __init__(self, method, map_grid, policy, seed, shuffle, remembers_advice=True, budget=0,
                 when='early'):
        self.world = GridWorld(map_grid, 'map', RUN, seed)
        self.mentor = Mentor(budget, when)
        self.learner = Learner(method, seed, remembers_advice)
        self.policy, self.shuffle, self.reports = policy, shuffle, []
        self.open = []
        for msg in (self.world.description, self.world.question):
            self.lay(msg)

    def lay(self, msg):
        """Put a message on the table, once for each listener."""
        listeners = {StateReward: (self.tell_mentor, self.learner.observe),
                     Recommendation: (self.learner.on_recommendation,),
                     Action: (self.world.on_action, self.mentor.on_action)}
        if type(msg).__name__ == 'WorldDescription':
            listeners = {type(msg): (self.tell_mentor_of_world, self.learner.on_world)}
        for listener in listeners.get(type(msg), ()):
            self.open.append((listener, msg))
        if type(msg) not in listeners:
            self.reports.append(msg)

    def tell_mentor(self, msg):
        """Let the mentor hear a state."""
        return self.mentor.observe(msg)

    def tell_mentor_of_world(self, msg):
        """Let the mentor hear of the world, and make its policy."""
        return self.mentor.use(self.policy) if self.mentor.on_world(msg) else ()

    def hold(self):
        """Let them talk until nothing is left to be said."""
        while self.open:
            index = self.shuffle.randrange(len(self.open))
            listener, msg = self.open[index]
            if self.shuffle.random() > 0.1:
                del self.open[index]
            for answer in listener(msg):
                self.lay(answer)
        return self


@pytest.mark.parametrize('remembers', [True, False])
@pytest.mark.parametrize('profile, name', ROWS)
def test_any_order_and_repetition_gives_the_bits_of_the_compiled_loop(profile, name, remembers):
    bar = read_map('bar_grid', profile)
    policy = noisy_policy(World(bar), 0.3, random_streams(8)[0])
    row = replace(find_method(name, profile), episodes=3, iterations=3)
    training = Training(World(bar), policy, row, seed=4)
    iterations = [training.iterate() for _ in range(3)]
    table = Table(row, bar, policy, 4, random.Random(1), remembers).hold()
    assert table.learner.memory.digest() == training.memory.digest()
    progress = [msg for msg in table.reports if isinstance(msg, Progress)]
    assert [msg.mean_return for msg in progress] == [it.mean_return for it in iterations]
    assert repr([msg.confidence for msg in progress]) == repr([i.confidence for i in iterations])
    assert [msg.temperature for msg in progress] == [it.temperature for it in iterations]
    assert progress[-1].steps == sum(it.steps for it in iterations)
    assert [msg.finished for msg in progress] == [False, False, True]
    episodes = [msg for msg in table.reports if isinstance(msg, Episode)]
    assert len(episodes) == 9
    assert sum(msg.steps for msg in episodes) == progress[-1].steps
    assert all(msg.terminated != msg.truncated for msg in episodes)


@pytest.mark.parametrize('when, remembers', [
    ('early', True), ('early', False), ('important', True), ('important', False),
    ('mistakes', False)])
@pytest.mark.parametrize('shuffle', range(3))
def test_a_mentor_with_a_budget_says_the_same_in_any_order(when, remembers, shuffle):
    bar = read_map('bar_grid', 'published')
    policy = sparse_policy(noisy_policy(World(bar), 0.3, random_streams(8)[0]), World(bar), 0.8, 2)
    row = replace(find_method('explicit', 'published'), episodes=3, iterations=3)
    told = AdviceBudget(World(bar), policy, 25, when)
    training = Training(World(bar), told, row, seed=4)
    iterations = [training.iterate() for _ in range(3)]
    table = Table(row, bar, policy, 4, random.Random(shuffle), remembers, 25, when).hold()
    assert table.learner.memory.digest() == training.memory.digest()
    progress = [msg for msg in table.reports if isinstance(msg, Progress)]
    assert repr([msg.confidence for msg in progress]) == repr([i.confidence for i in iterations])
    assert told.remaining[0] < 25


@pytest.mark.parametrize('shuffle', range(20))
def test_a_watching_mentor_waits_for_the_last_action_of_an_episode_too(shuffle):
    tiny = grid('G.#', starts=(1,), limit=30, intended=0.5)
    policy = optimal_policy(World(tiny))
    row = replace(find_method('explicit', 'published'), episodes=3, iterations=3)
    training = Training(World(tiny), AdviceBudget(World(tiny), policy, 3, 'mistakes'), row, seed=4)
    for _ in range(3):
        training.iterate()
    table = Table(row, tiny, policy, 4, random.Random(shuffle), False, 3, 'mistakes').hold()
    assert table.learner.memory.digest() == training.memory.digest()
