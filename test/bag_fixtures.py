# SPDX-License-Identifier: Apache-2.0
"""Recorded conversations for tests: held in process, and written as `ros2 bag record` does."""

from dataclasses import asdict, replace
from itertools import count
import json
from pathlib import Path

import numpy as np
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from comply_ros.bags.bag_writer import BagWriter
from comply_ros.bags.message_decoder import kind_of
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

TEXTS = {f'comply_msgs/msg/{path.stem}': path.read_text()
         for path in (Path(__file__).parents[1] / 'msg_defs' / 'msg').glob('*.msg')}
NAMES = {StateReward: 'state', Recommendation: 'recommendation', Action: 'action',
         Episode: 'episode', Progress: 'progress'}


class Held:
    """A conversation that was held: `spoken` is all of it, as (topic, tuple), and the digest."""

    def __init__(self, method='beta_implicit', iterations=3, episodes=4, seed=3, run=7, number=5):
        self.row = replace(METHODS['published'][method], iterations=iterations, episodes=episodes)
        self.grid = read_map('bar_grid', 'published')
        self.world = GridWorld(self.grid, 'bar_grid', run, seed)
        self.mentor, self.learner = Mentor(), Learner(self.row, seed, number=number)
        self._name, self._seed, self.spoken = method, seed, []
        self._begin()
        while not self.learner.finished:
            self._turn()
        self._say('trust', Trust(run, self.grid.width, self.grid.height, confidence_map(
            self.row, self.learner.memory, self.learner.advice_heard())))
        self.describe(self.learner.memory.digest())
        self.digest = self.learner.memory.digest()

    def describe(self, digest=''):
        """Have the learner say who it is."""
        self._say('method', LearnerDescription(
            self.learner.described.run, self.learner.number, self.learner.turns, self._name,
            json.dumps(asdict(self.row)), self._seed, True, digest))

    def _begin(self):
        described = self.world.description
        self._say('world', described)
        self.mentor.on_world(described)
        self.learner.on_world(described)
        self.describe()
        policy = noisy_policy(World(self.grid), 0.3, np.random.default_rng(0))
        self.mentor.use(policy)
        self._say('mentor_policy', Policy(described.run, self.grid.width, self.grid.height,
                                          policy.tolist()))

    def _turn(self):
        asked = self.world.question
        self._say('state', asked)
        answers = self.learner.observe(asked)
        for advice in self.mentor.observe(asked):
            self._say('recommendation', advice)
            answers += self.learner.on_recommendation(advice)
        for msg in answers:
            self._say(NAMES[type(msg)], msg)
        for msg in (each for each in answers if type(each) is Action):
            for news in self.world.on_action(msg):
                if type(news) is Episode:
                    self._say('episode', news)

    def _say(self, topic, msg):
        self.spoken.append((topic, msg))


def write(path, spoken, storage='mcap', namespace='', flushes=200):
    """Write what was said to a bag; return its path. A chunk of MCAP has so many messages."""
    bag = BagWriter(path, TEXTS, storage)
    store = get_typestore(Stores.EMPTY)
    for kind, text in TEXTS.items():
        store.register(get_types_from_msg(text, kind))
    for name in TOPIC_TYPES:
        bag.add(f'{namespace}/{name}', kind_of(name))
    for number, (name, msg) in zip(count(1), spoken):
        bag.write(f'{namespace}/{name}', 10 ** 18 + number, serialize(store, name, msg))
        if storage == 'mcap' and number % flushes == 0:
            bag.flush()
    bag.close()
    return path


def serialize(store, name, msg):
    """Return the bytes of a message."""
    kind = kind_of(name)
    arrays = {'starts': np.uint32, 'confidence': np.float32, 'action': np.int8}
    values = {field: np.array(value, arrays[field]) if field in arrays and np.ndim(value)
              else list(value) if type(value) is tuple else value
              for field, value in msg._asdict().items()}
    return store.serialize_cdr(store.types[kind](**values), kind)
