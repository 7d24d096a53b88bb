# SPDX-License-Identifier: Apache-2.0
"""Messages of one run in a room of nine cells, and a learner and a mentor that take part in it."""

from dataclasses import replace

import numpy as np
from tiny_worlds import grid

from comply_ros.learner.presets import METHODS
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Recommendation, StateReward
from comply_ros.protocol.world_description import describe_world
from comply_ros.world.grid import NO_ACTION, UP
from comply_ros.world.mdp import World

RUN = 7
ROOM = grid('..G', '...', '...', starts=(0,))
ROOM_MSG = describe_world(ROOM, 'room', RUN)
UP_EVERYWHERE = np.where(World(ROOM).free, UP, NO_ACTION)
CONFIG = replace(METHODS['report']['constant'], confidence=1.0, episodes=2, iterations=3)


def state(episode=1, step=0, s=0, reward=0.0, terminated=False, truncated=False, run=RUN):
    """Return a `StateReward`."""
    return StateReward(run, episode, step, s, reward, terminated, truncated)


def advice(episode=1, step=0, s=0, action=UP, run=RUN):
    """Return a `Recommendation`."""
    return Recommendation(run, episode, step, s, action)


def make_learner(number=1, remembers_advice=True, **settings):
    """Return a learner that has received the world."""
    learner = Learner(replace(CONFIG, **settings), 0, remembers_advice, number)
    learner.on_world(ROOM_MSG)
    return learner


def make_mentor(budget=0, mode='early'):
    """Return a mentor that advises up everywhere in the room."""
    mentor = Mentor(budget, mode)
    assert mentor.on_world(ROOM_MSG)
    assert mentor.use(UP_EVERYWHERE) == ()
    return mentor


def follow_instead(actor, description):
    """Publish another world and two of its states while this one is silent; return outputs."""
    assert actor.on_world(description) == ()
    for _ in range(2):
        assert actor.observe(state(run=description.run)) == ()
    assert actor.tick() == ()
    return actor.tick()


def types(outputs):
    """Return the type of each output."""
    return [type(msg) for msg in outputs]
