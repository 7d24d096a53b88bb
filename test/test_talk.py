# SPDX-License-Identifier: Apache-2.0
"""World, mentor and learner at one table, in any order: the bits of the compiled loop."""

from dataclasses import replace
import random

import pytest
from test_methods import ROWS
from worlds import grid

from comply_ros.core.advising import Advising
from comply_ros.core.dialogue import Action, Episode, Progress, Recommendation, StateReward
from comply_ros.core.draws import streams
from comply_ros.core.learner_actor import LearnerActor
from comply_ros.core.mentor_actor import MentorActor
from comply_ros.core.mentors import noisy_policy, sparse_policy
from comply_ros.core.methods import find_method
from comply_ros.core.planning import optimal_policy
from comply_ros.core.training import Training
from comply_ros.core.world import World
from comply_ros.core.world_actor import WorldActor
from comply_ros.session.maps import read_map

RUN = 7


class Table:
    """
    World, mentor and learner at one table; messages lie on it until somebody takes them up.

    Every message that is said lies there for everybody who listens to it; `shuffle` decides which
    one is taken up next, and which is taken up twice.
    """

    def __init__(self, method, map_grid, policy, seed, shuffle, remembers_advice=True, budget=0,
                 when='early'):
        self.world = WorldActor(map_grid, 'map', RUN, seed)
        self.mentor = MentorActor(budget, when)
        self.learner = LearnerActor(method, seed, remembers_advice)
        self.policy, self.shuffle, self.reports = policy, shuffle, []
        self.open = []
        for said in (self.world.description, self.world.question):
            self.lay(said)

    def lay(self, said):
        """Put a message on the table, once for each listener."""
        listeners = {StateReward: (self.tell_mentor, self.learner.hear_state),
                     Recommendation: (self.learner.hear_recommendation,),
                     Action: (self.world.hear_action, self.mentor.hear_action)}
        if type(said).__name__ == 'WorldDescription':
            listeners = {type(said): (self.tell_mentor_of_world, self.learner.hear_world)}
        for listener in listeners.get(type(said), ()):
            self.open.append((listener, said))
        if type(said) not in listeners:
            self.reports.append(said)

    def tell_mentor(self, said):
        """Let the mentor hear a state."""
        return self.mentor.hear_state(said)

    def tell_mentor_of_world(self, said):
        """Let the mentor hear of the world, and make its policy."""
        return self.mentor.use(self.policy) if self.mentor.hear_world(said) else ()

    def hold(self):
        """Let them talk until nothing is left to be said."""
        while self.open:
            index = self.shuffle.randrange(len(self.open))
            listener, said = self.open[index]
            if self.shuffle.random() > 0.1:
                del self.open[index]
            for answer in listener(said):
                self.lay(answer)
        return self


@pytest.mark.parametrize('remembers', [True, False])
@pytest.mark.parametrize('profile, name', ROWS)
def test_any_order_and_repetition_gives_the_bits_of_the_compiled_loop(profile, name, remembers):
    bar = read_map('bar_grid', profile)
    policy = noisy_policy(World(bar), 0.3, streams(8)[0])
    row = replace(find_method(name, profile), episodes=3, iterations=3)
    training = Training(World(bar), policy, row, seed=4)
    iterations = [training.iterate() for _ in range(3)]
    table = Table(row, bar, policy, 4, random.Random(1), remembers).hold()
    assert table.learner.memory.digest() == training.memory.digest()
    progress = [said for said in table.reports if isinstance(said, Progress)]
    assert [said.mean_return for said in progress] == [it.mean_return for it in iterations]
    assert repr([said.confidence for said in progress]) == repr([i.confidence for i in iterations])
    assert [said.temperature for said in progress] == [it.temperature for it in iterations]
    assert progress[-1].steps == sum(it.steps for it in iterations)
    assert [said.finished for said in progress] == [False, False, True]
    episodes = [said for said in table.reports if isinstance(said, Episode)]
    assert len(episodes) == 9
    assert sum(said.steps for said in episodes) == progress[-1].steps
    assert all(said.terminated != said.truncated for said in episodes)


@pytest.mark.parametrize('when, remembers', [
    ('early', True), ('early', False), ('important', True), ('important', False),
    ('mistakes', False)])
@pytest.mark.parametrize('shuffle', range(3))
def test_a_mentor_with_a_budget_says_the_same_in_any_order(when, remembers, shuffle):
    bar = read_map('bar_grid', 'published')
    policy = sparse_policy(noisy_policy(World(bar), 0.3, streams(8)[0]), World(bar), 0.8, 2)
    row = replace(find_method('explicit', 'published'), episodes=3, iterations=3)
    told = Advising(World(bar), policy, 25, when)
    training = Training(World(bar), told, row, seed=4)
    iterations = [training.iterate() for _ in range(3)]
    table = Table(row, bar, policy, 4, random.Random(shuffle), remembers, 25, when).hold()
    assert table.learner.memory.digest() == training.memory.digest()
    progress = [said for said in table.reports if isinstance(said, Progress)]
    assert repr([said.confidence for said in progress]) == repr([i.confidence for i in iterations])
    assert told.left[0] < 25


@pytest.mark.parametrize('shuffle', range(20))
def test_a_watching_mentor_waits_for_the_last_action_of_an_episode_too(shuffle):
    tiny = grid('G.#', starts=(1,), limit=30, intended=0.5)
    policy = optimal_policy(World(tiny))
    row = replace(find_method('explicit', 'published'), episodes=3, iterations=3)
    training = Training(World(tiny), Advising(World(tiny), policy, 3, 'mistakes'), row, seed=4)
    for _ in range(3):
        training.iterate()
    table = Table(row, tiny, policy, 4, random.Random(shuffle), False, 3, 'mistakes').hold()
    assert table.learner.memory.digest() == training.memory.digest()
