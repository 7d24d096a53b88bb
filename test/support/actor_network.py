# SPDX-License-Identifier: Apache-2.0
"""World, mentor and learner on a network without ROS: every message reaches all that subscribe."""

from collections import deque
import random

from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Action, Recommendation, StateReward, WorldDescription
from comply_ros.protocol.world import WorldMachine

RUN = 7


class OrderedNetwork:
    """
    A world, a mentor and a learner on a network that loses nothing and keeps the order.

    Attributes
    ----------
    outputs: everything that was published or logged.

    """

    def __init__(self, world, mentor, learner):
        self.world, self.mentor, self.learner = world, mentor, learner
        self.outputs, self._on_the_way = [], deque()
        self.publish(world.last_outputs())

    @property
    def observations(self):
        """The observations that were published, without repetitions."""
        found = [msg for msg in self.outputs if type(msg) is StateReward]
        return [msg for before, msg in zip([None, *found], found) if msg != before]

    def publish(self, outputs):
        """Put outputs on the way to their subscribers."""
        self.outputs += outputs
        self._on_the_way += outputs

    def run(self, messages=float('inf')):
        """Deliver so many messages, or until nothing is on the way; return how many."""
        count = 0
        while self._on_the_way and count < messages:
            msg = self._on_the_way.popleft()
            for receive in self._subscribers(msg):
                self.publish(receive(msg))
            count += 1
        return count

    def _subscribers(self, msg):
        return {WorldDescription: (self.mentor.on_world, self.learner.on_world),
                StateReward: (self.mentor.observe, self.learner.observe),
                Recommendation: (self.learner.on_recommendation,),
                Action: (self.world.on_action,)}.get(type(msg), ())


class ShuffledNetwork:
    """
    A world, a mentor and a learner on a network that delivers in any order, and at times twice.

    Attributes
    ----------
    on_the_way: (subscriber, message) of what was published and not delivered yet.
    reports: outputs that none of the three subscribes to.

    """

    def __init__(self, config, grid, policy, seed, shuffle: random.Random, remembers_advice=True,
                 budget=0, mode='early'):
        self.world = WorldMachine(grid, 'map', RUN, seed)
        self.mentor = Mentor(budget, mode)
        self.learner = Learner(config, seed, remembers_advice)
        self.policy, self.shuffle = policy, shuffle
        self.on_the_way, self.reports = [], []
        for msg in (self.world.description, self.world.observation):
            self.publish(msg)

    def publish(self, msg):
        """Put a message on the way to each of its subscribers."""
        subscribers = {
            WorldDescription: (self.deliver_world_to_mentor, self.learner.on_world),
            StateReward: (self.mentor.observe, self.learner.observe),
            Recommendation: (self.learner.on_recommendation,),
            Action: (self.world.on_action, self.mentor.on_action)}
        if type(msg) in subscribers:
            self.on_the_way += [(receive, msg) for receive in subscribers[type(msg)]]
        else:
            self.reports.append(msg)

    def deliver_world_to_mentor(self, msg):
        """Let the mentor receive the world, and give it its policy."""
        return self.mentor.use(self.policy) if self.mentor.on_world(msg) else ()

    def run(self):
        """Deliver until nothing is on the way; return this network."""
        while self.on_the_way:
            index = self.shuffle.randrange(len(self.on_the_way))
            receive, msg = self.on_the_way[index]
            if self.shuffle.random() > 0.1:
                del self.on_the_way[index]
            for answer in receive(msg):
                self.publish(answer)
        return self
