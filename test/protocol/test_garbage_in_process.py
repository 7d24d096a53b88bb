# SPDX-License-Identifier: Apache-2.0
"""Garbage among the messages of a training: it changes no bit and stops nobody, without ROS."""

from collections import Counter
from dataclasses import replace
import random

from actor_network import RUN, ShuffledNetwork
from hypothesis import given
from hypothesis import strategies as st
from message_strategies import GARBAGE
import pytest

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.mentor.mentor_policies import noisy_policy
from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.messages import (
    Action,
    Progress,
    Recommendation,
    Rejected,
    StateReward,
    WorldDescription,
)
from comply_ros.protocol.world import WorldMachine
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World
from examples import examples, GENERATE

SUBSCRIBED = WorldDescription, StateReward, Recommendation, Action
BAR = read_map('bar_grid', 'published')
POLICY = noisy_policy(World(BAR), 0.3, random_streams(8)[0])
HANDFULS = st.lists(st.one_of([st.tuples(st.just(each), GARBAGE[each]) for each in SUBSCRIBED]),
                    min_size=30, max_size=60)


class DirtyNetwork(ShuffledNetwork):
    """
    A network on which garbage is published, as soon as the first observation is answered.

    Attributes
    ----------
    newest: the newest true message of each type.
    published_garbage: number of messages of garbage by type.

    """

    def __init__(self, *arguments):
        self.newest, self.published_garbage = {}, Counter()
        super().__init__(*arguments)

    def publish(self, msg):
        """Put a message on the way to each of its subscribers, and remember it."""
        self.newest[type(msg)] = msg
        super().publish(msg)

    def run_among(self, garbage):
        """Deliver until the learner has finished, with garbage in between, all of it used."""
        rest, repetitions = [], 0
        while not self.learner.finished and repetitions < 1000:
            if not self.on_the_way:  # as its node does
                repetitions += 1
                self.publish(self.world.observation)
            self.deliver_one()
            if self.world.step_count > 1 and self.learner.step_count > 1 \
                    and len(self.on_the_way) < 40:
                message_type, spoil = rest.pop() if rest else rest.extend(garbage) or rest.pop()
                if message_type in self.newest:
                    self.publish_garbage(message_type, spoil(self.newest[message_type]))
        return self

    def deliver_one(self):
        """Deliver one of the messages that are on the way."""
        receive, msg = self.on_the_way.pop(self.shuffle.randrange(len(self.on_the_way)))
        for answer in receive(msg):
            self.publish(answer)

    def publish_garbage(self, message_type, msg):
        """Deliver garbage to all subscribers at once; the world receives worlds, too."""
        self.published_garbage[message_type] += 1
        before, newest = len(self.on_the_way), self.newest.get(message_type)
        self.publish(msg)
        self.newest[message_type] = newest
        garbage, self.on_the_way = self.on_the_way[before:], self.on_the_way[:before]
        if message_type is WorldDescription:
            garbage.append((lambda other: self.world.on_world(other, age=0.5), msg))
        for receive, each in garbage:
            try:
                answers = receive(each)
            except ValueError:  # no world: the node logs it
                answers = (Rejected('not a world', ''),)
            for answer in answers:
                self.publish(answer)

    def deliver_world_to_mentor(self, msg):
        """Let the mentor receive a world; it has its policy from the first on."""
        outputs = self.mentor.on_world(msg)
        return self.mentor.use(self.policy) if self.mentor.policy is None else outputs


@pytest.mark.parametrize('name, remembers_advice, budget', [
    ('beta_implicit', True, 0), ('explicit', False, 0), ('q_learning', True, 0),
    ('beta_implicit', False, 12)])
@examples(8, phases=GENERATE)
@given(garbage=HANDFULS, number=st.integers(0, 1000))
def test_garbage_changes_no_bit_and_stops_no_training(name, remembers_advice, budget, garbage,
                                                      number):
    config = replace(find_method(name, 'published'), episodes=2, iterations=2)
    training = Training(World(BAR), AdviceBudget(World(BAR), POLICY, budget, 'mistakes'), config,
                        seed=4)
    returns = [training.iterate().mean_return for _ in range(2)]
    network = DirtyNetwork(config, BAR, POLICY, 4, random.Random(number), remembers_advice,
                           budget, 'mistakes').run_among(garbage)
    assert network.learner.finished, 'the training stopped'
    assert not (network.learner.tracker.inactive or network.world.inactive)
    assert network.learner.state.digest() == training.state.digest()
    progress = [msg for msg in network.reports if isinstance(msg, Progress)]
    assert [msg.mean_return for msg in progress] == returns
    assert network.published_garbage


def make_pair():
    """Return a world, and a learner without a mentor that has answered its first observation."""
    world = WorldMachine(BAR, 'bar', RUN, 4)
    learner = Learner(find_method('q_learning', 'published'), 4)
    learner.on_world(world.description)
    world.on_action(*learner.observe(world.observation))
    return world, learner


def test_observations_for_another_learner_in_no_order_make_no_learner_inactive():
    world, learner = make_pair()
    shuffle = random.Random(1)
    for _ in range(200):
        learner.observe(world.observation._replace(
            episode=shuffle.randrange(2, 2 ** 32), step=shuffle.randrange(9), learner=99))
    assert not learner.tracker.inactive
    for step in range(20):
        learner.observe(world.observation._replace(episode=3, step=step + 1, learner=99))
    assert learner.tracker.inactive


def test_two_different_unlikely_moves_are_not_one_that_is_repeated():
    world, learner = make_pair()
    bar = World(BAR)
    far = [s for s in range(121)
           if bar.free[s] and not bar.leads(learner.tracker.answered_state, s)]
    for s in far[:5]:
        rejected, = learner.observe(world.observation._replace(state=s, terminated=False))
        assert type(rejected) is Rejected
    action, = learner.observe(world.observation)
    assert type(action) is Action
