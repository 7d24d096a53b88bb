# SPDX-License-Identifier: Apache-2.0
"""All topics and services: name, message type, the tuple with the same fields, and QoS."""

from collections.abc import Callable
from typing import Any, NamedTuple

from comply_msgs import msg
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from comply_ros.nodes import cdr
from comply_ros.protocol import messages

# One observation is open at a time, so only the newest message counts; late subscribers get it.
LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                     durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Reports follow each other; late subscribers receive the last thousand.
REPORTED = QoSProfile(depth=messages.REPORTS, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Topic(NamedTuple):
    """
    A topic.

    Attributes
    ----------
    name: relative.
    message: the class of its messages.
    tuple_type: the tuple with the same fields.
    qos: how it is published and subscribed to.
    raw: whether its messages have a fixed size, and are read and written as bytes.

    """

    name: str
    message: type[Any]
    tuple_type: type[Any]
    qos: QoSProfile
    raw: bool = False


def _topic(name: str, qos: QoSProfile) -> Topic:
    tuple_type = messages.TOPIC_TYPES[name]
    message = getattr(msg, tuple_type.__name__)
    return Topic(name, message, tuple_type, qos, cdr.layout(message) is not None)


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

LOOP = (WORLD, STATE, RECOMMENDATION, ACTION)  # what a step of the run waits for

RECOMMEND = 'recommend'  # service of the mentor
SAVE = 'save'  # service of the learner
PAUSE, STEP = '~/pause', '~/step'  # services of the world
RESET = '~/reset'  # service of the world, and of the learner
ANOTHER = 'another learner is meant'  # how `save` answers a request for another learner


def decoder(topic: Topic) -> Callable[[Any], Any]:
    """Return a function from a message to its tuple."""
    tuple_type, names = topic.tuple_type, topic.tuple_type._fields
    return lambda message: tuple_type(*[getattr(message, name) for name in names])


def encoder(topic: Topic) -> Callable[[Any], Any]:
    """Return a function from a tuple to its message: always the same object, filled anew."""
    message, names = topic.message(), topic.tuple_type._fields

    def encode(values: Any) -> Any:
        for name, value in zip(names, values):
            setattr(message, name, value)
        return message
    return encode
