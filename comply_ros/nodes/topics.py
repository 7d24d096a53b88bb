# SPDX-License-Identifier: Apache-2.0
"""All topics in one place: name, message, what is said on it, and how it is delivered."""

from typing import NamedTuple

from comply_msgs import msg
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from comply_ros.protocol import messages

# One question is open at a time, so only the newest message counts; it stays for who comes late.
LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                     durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Reports follow each other; who comes late gets the last thousand.
REPORTED = QoSProfile(depth=messages.REPORTS, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Topic(NamedTuple):
    """A topic: its relative name, the message, the tuple with the same fields, its QoS."""

    name: str
    message: type
    tuple_type: type
    qos: QoSProfile


def _topic(name, qos):
    tuple_type = messages.TOPIC_TYPES[name]
    return Topic(name, getattr(msg, tuple_type.__name__), tuple_type, qos)


WORLD = _topic('world', LATCHED)
STATE = _topic('state', LATCHED)
RECOMMENDATION = _topic('recommendation', LATCHED)
ACTION = _topic('action', LATCHED)
EPISODE = _topic('episode', REPORTED)
PROGRESS = _topic('progress', REPORTED)
TRUST = _topic('trust', LATCHED)
POLICY = _topic('policy', LATCHED)
VALUES = _topic('values', LATCHED)
MENTOR_POLICY = _topic('mentor_policy', LATCHED)
DESCRIPTION = _topic('method', REPORTED)

RECOMMEND = 'recommend'  # service of the mentor
SAVE = 'save'  # service of the learner
PAUSE, STEP = '~/pause', '~/step'  # services of the world
RESET = '~/reset'  # service of the world, and of the learner
ANOTHER = 'another learner is meant'  # what it says to who means another


def decoder(topic):
    """Return a function from a message to its tuple."""
    tuple_type, names = topic.tuple_type, topic.tuple_type._fields
    return lambda message: tuple_type(*[getattr(message, name) for name in names])


def encoder(topic):
    """Return a function from a tuple to its message: always the same object, filled anew."""
    message, names = topic.message(), topic.tuple_type._fields

    def encode(values):
        for name, value in zip(names, values):
            setattr(message, name, value)
        return message
    return encode
