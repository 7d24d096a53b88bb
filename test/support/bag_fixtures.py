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
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.mentor_topics import name_of_mentor, topic_and_mentor
from comply_ros.protocol.messages import (
    Action,
    Episode,
    INNER_TUPLES,
    LearnerDescription,
    NANOSECONDS,
    Notice,
    Policy,
    Progress,
    Recommendation,
    StateReward,
    TOPIC_TYPES,
    Trust,
)
from comply_ros.protocol.world import WorldMachine
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World

DEFINITIONS = {f'comply_msgs/msg/{path.stem}': path.read_text()
               for path in (Path(__file__).parents[2] / 'msg_defs' / 'msg').glob('*.msg')} | {
    'builtin_interfaces/msg/Time': 'int32 sec\nuint32 nanosec\n',
    'std_msgs/msg/Header': 'builtin_interfaces/Time stamp\nstring frame_id\n'}
# The messages of version 0.1.0, whose protocol has the number 1.
OLD_DEFINITIONS = {f'comply_msgs/msg/{name}': text.replace(', ', '\n') for name, text in {
    'WorldDescription': 'uint32 run, float64 began, string name, uint32 width, uint32 height, '
    'string[] rows, uint32[] starts, float64 step_reward, float64 obstacle_reward, '
    'float64 goal_reward, float64 intended, uint32 step_limit, bool slips_bump, string sha256, '
    'uint32 replaces',
    'StateReward': 'uint32 run, uint32 episode, uint32 step, uint32 state, float64 reward, '
    'bool terminated, bool truncated, uint32 learner',
    'Recommendation': 'uint32 run, uint32 episode, uint32 step, uint32 state, int8 action',
    'Action': 'uint32 run, uint32 episode, uint32 step, int8 action, bool followed, '
    'float64 confidence, uint32 learner, int8 advice, uint64 turns',
    'Episode': 'uint32 run, uint32 episode, uint32 steps, float64 total_reward, bool terminated, '
    'bool truncated',
    'Progress': 'uint32 run, uint32 iteration, uint32 iterations, uint32 episodes, uint64 steps, '
    'float64 mean_return, float64 confidence, float64 temperature, bool finished',
    'Trust': 'uint32 run, uint32 width, uint32 height, float32[] confidence',
    'Policy': 'uint32 run, uint32 width, uint32 height, int8[] action',
    'Values': 'uint32 run, uint32 width, uint32 height, float64[] value',
    'LearnerDescription': 'uint32 run, uint32 learner, uint64 turns, string method, '
    'string settings, uint64 seed, bool remembers_advice, string digest'}.items()}
TIME = 'builtin_interfaces/msg/Time'
ARRAYS = {'starts': np.uint32, 'confidence': np.float32, 'action': np.int16, 'first': np.uint32,
          'successor': np.uint32, 'terminal': np.uint32, 'probability': np.float64,
          'reward': np.float64, 'positions': np.float64, 'available': np.bool_,
          'all_advice': np.int16}
TOPICS = {StateReward: 'state', Recommendation: 'recommendation', Action: 'action',
          Episode: 'episode', Progress: 'progress'}


class SimulatedRun:
    """
    A whole training: `messages` has all of it as (topic, tuple), `digest` what was learned.

    mentors: names. joining: after how many observations others want to join, by name.
    """

    def __init__(self, method='beta_implicit', iterations=3, episodes=4, seed=3, run=7, number=5,
                 mentors=('',), joining=None, **settings):
        self.config = replace(METHODS['published'][method], iterations=iterations,
                              episodes=episodes, **settings)
        self.grid = read_map('bar_grid', 'published')
        self.world = WorldMachine(self.grid, 'bar_grid', run, seed)
        self.joining = joining or {}
        self.mentors = {name: Mentor(name=name) for name in (*mentors, *self.joining)}
        self.learner = Learner(self.config, seed, number=number, mentors=mentors)
        self._method, self._seed, self.messages = method, seed, []
        self._start()
        while not self.learner.finished:
            self._step()
        confidence = confidence_map(self.config, self.learner.state, self.learner.advice())
        for name, row in zip(self.learner.mentors,
                             confidence.reshape(len(self.learner.mentors), -1)):
            self._publish('trust', Trust(run, row.tolist(), name))
        self.digest = self.learner.state.digest()
        self._describe_learner(self.digest)

    def _start(self):
        description = self.world.description
        self._publish('world', description)
        self.learner.on_world(description)
        self._describe_learner()
        for m, (name, mentor) in enumerate(self.mentors.items()):
            mentor.on_world(description)
            policy = noisy_policy(World(self.grid), 0.3, np.random.default_rng(m))
            mentor.use(policy)
            self._publish(name_of_mentor('mentor_policy', name),
                          Policy(description.run, policy.tolist()))

    def _describe_learner(self, digest='', count=None):
        self._publish('method', LearnerDescription(
            self.learner.tracker.run, self.learner.number,
            self.learner.step_count if count is None else count, self._method,
            json.dumps(asdict(self.config)), self._seed, True, digest, self.learner.mentors))

    def _step(self):
        observation, before = self.world.observation, self.learner.step_count
        self._publish('state', observation)
        for name, answered in self.joining.items():
            if answered == before:
                self.learner.join(name)
        outputs = self.learner.observe(observation)
        if outputs and type(outputs[0]) is Notice:  # mentors have joined
            self._describe_learner(count=before)
            outputs = outputs[1:]
        for name, mentor in self.mentors.items():
            for recommendation in mentor.observe(observation):
                self._publish(name_of_mentor('recommendation', name), recommendation)
                if name in self.learner.mentors:
                    m = self.learner.mentors.index(name)
                    outputs += self.learner.on_recommendation(recommendation, m)
        for msg in outputs:
            self._publish(TOPICS[type(msg)], msg)
        for action in (msg for msg in outputs if type(msg) is Action):
            for msg in self.world.on_action(action):
                if type(msg) is Episode:
                    self._publish('episode', msg)

    def _publish(self, topic, msg):
        self.messages.append((topic, msg))


def write_bag(path, messages, storage='mcap', namespace='', chunk=200, definitions=DEFINITIONS):
    """Write messages to a bag, so many in a chunk of an MCAP file; return its path."""
    bag = BagWriter(path, definitions, storage)
    store = types(tuple(definitions.items()))
    messages = list(messages)
    for topic in dict.fromkeys((*TOPIC_TYPES, *(topic for topic, _ in messages))):
        bag.add(f'{namespace}/{topic}', message_type(topic_and_mentor(topic)[0]))
    for number, (topic, msg) in zip(count(1), messages):
        bag.write(f'{namespace}/{topic}', 10 ** 18 + number, serialize(store, topic, msg))
        if number % chunk == 0:
            bag.flush()
    bag.close()
    return path


@cache
def types(definitions):
    """Return the types of messages by (name, definition), parsed once in a process."""
    store, found = get_typestore(Stores.EMPTY), {}
    for name, text in definitions:
        found.update(get_types_from_msg(text, name))
    store.register(found)
    return store


def serialize(store, topic, msg):
    """Return the bytes of a message."""
    name = message_type(topic_and_mentor(topic)[0])
    if 'std_msgs/msg/Header' not in store.types:
        return store.serialize_cdr(to_old_message(store, name, msg), name)
    header = store.types['std_msgs/msg/Header'](store.types[TIME](5, 6), '')
    return store.serialize_cdr(to_message(store, name, msg, header=header), name)


def to_old_message(store, name, msg):
    """Return a message of version 0.1.0 with what a tuple says."""
    facts = msg._asdict()
    if 'grid' in facts:
        facts |= facts['grid']._asdict()
    facts |= {'turns': facts.get('observation_count'), 'width': 11, 'height': 11, 'slips': True}
    fields = [field for field, _ in store.fielddefs[name][1]]
    values = {field: facts[field] for field in fields}
    kinds = {**ARRAYS, 'action': np.int8}
    return store.types[name](**{
        field: np.array(value, kinds[field]) if field in kinds and np.ndim(value) else
        list(value) if type(value) is tuple else float(value) if field == 'began' else value
        for field, value in values.items()})


def to_message(store, name, msg, **more):
    """Return a message of a type with those fields of a tuple that the type has."""
    values, fields = {}, {field for field, _ in store.fielddefs[name][1]}
    for field, value in msg._asdict().items():
        if field not in fields:
            continue
        if field in INNER_TUPLES:
            kind = f'comply_msgs/msg/{INNER_TUPLES[field].__name__}'
            value = to_message(store, kind, value)
        elif field == 'began':
            value = store.types[TIME](*divmod(value, NANOSECONDS))
        elif field in ARRAYS and np.ndim(value):
            value = np.array(value, ARRAYS[field])
        values[field] = list(value) if type(value) is tuple else value
    return store.types[name](**values, **more)
