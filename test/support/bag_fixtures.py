# SPDX-License-Identifier: Apache-2.0
"""Runs of world, mentor and learner in this process, and bags of them as ROS records them."""

from dataclasses import asdict, replace
from functools import cache
from itertools import count
import json
from pathlib import Path

import numpy as np
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from comply_ros.bags.bag_writer import BagWriter
from comply_ros.bags.message_decoder import message_type
from comply_ros.learner.confidence import confidence_map
from comply_ros.learner.presets import METHODS
from comply_ros.mentor.mentor_policies import noisy_policy
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import (
    Action,
    Episode,
    LearnerDescription,
    Policy,
    Progress,
    Recommendation,
    StateReward,
    TOPIC_TYPES,
    Trust,
)
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World

DEFINITIONS = {f'comply_msgs/msg/{path.stem}': path.read_text()
               for path in (Path(__file__).parents[2] / 'msg_defs' / 'msg').glob('*.msg')}
TOPICS = {StateReward: 'state', Recommendation: 'recommendation', Action: 'action',
          Episode: 'episode', Progress: 'progress'}


class SimulatedRun:
    """A whole training: `messages` has all of it as (topic, tuple), `digest` what was learned."""

    def __init__(self, method='beta_implicit', iterations=3, episodes=4, seed=3, run=7, number=5,
                 **settings):
        self.config = replace(METHODS['published'][method], iterations=iterations,
                              episodes=episodes, **settings)
        self.grid = read_map('bar_grid', 'published')
        self.world = GridWorld(self.grid, 'bar_grid', run, seed)
        self.mentor, self.learner = Mentor(), Learner(self.config, seed, number=number)
        self._method, self._seed, self.messages = method, seed, []
        self._start()
        while not self.learner.finished:
            self._step()
        self._publish('trust', Trust(run, self.grid.width, self.grid.height, confidence_map(
            self.config, self.learner.state, self.learner.advice())))
        self.digest = self.learner.state.digest()
        self._describe_learner(self.digest)

    def _start(self):
        description = self.world.description
        self._publish('world', description)
        self.mentor.on_world(description)
        self.learner.on_world(description)
        self._describe_learner()
        policy = noisy_policy(World(self.grid), 0.3, np.random.default_rng(0))
        self.mentor.use(policy)
        self._publish('mentor_policy', Policy(description.run, self.grid.width, self.grid.height,
                                              policy.tolist()))

    def _describe_learner(self, digest=''):
        self._publish('method', LearnerDescription(
            self.learner.tracker.run, self.learner.number, self.learner.step_count, self._method,
            json.dumps(asdict(self.config)), self._seed, True, digest))

    def _step(self):
        observation = self.world.observation
        self._publish('state', observation)
        outputs = self.learner.observe(observation)
        for recommendation in self.mentor.observe(observation):
            self._publish('recommendation', recommendation)
            outputs += self.learner.on_recommendation(recommendation)
        for msg in outputs:
            self._publish(TOPICS[type(msg)], msg)
        for action in (msg for msg in outputs if type(msg) is Action):
            for msg in self.world.on_action(action):
                if type(msg) is Episode:
                    self._publish('episode', msg)

    def _publish(self, topic, msg):
        self.messages.append((topic, msg))


def write_bag(path, messages, storage='mcap', namespace='', chunk=200):
    """Write messages to a bag, so many in a chunk of an MCAP file; return its path."""
    bag = BagWriter(path, DEFINITIONS, storage)
    for topic in TOPIC_TYPES:
        bag.add(f'{namespace}/{topic}', message_type(topic))
    for number, (topic, msg) in zip(count(1), messages):
        bag.write(f'{namespace}/{topic}', 10 ** 18 + number, serialize(topic, msg))
        if number % chunk == 0:
            bag.flush()
    bag.close()
    return path


@cache
def types():
    """Return the types of all messages, parsed once in a process."""
    store = get_typestore(Stores.EMPTY)
    for name, text in DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    return store


def serialize(topic, msg):
    """Return the bytes of a message."""
    store, name = types(), message_type(topic)
    arrays = {'starts': np.uint32, 'confidence': np.float32, 'action': np.int8}
    values = {field: np.array(value, arrays[field]) if field in arrays and np.ndim(value)
              else list(value) if type(value) is tuple else value
              for field, value in msg._asdict().items()}
    return store.serialize_cdr(store.types[name](**values), name)
