# SPDX-License-Identifier: Apache-2.0
"""All topics in one place: name, message, what is said on it, and how it is delivered."""

from typing import NamedTuple

from comply_msgs import msg
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from comply_ros.core import dialogue

# One question is open at a time, so only the newest message counts; it stays for who comes late.
LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                     durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Reports follow each other; who comes late gets the last thousand.
REPORTED = QoSProfile(depth=dialogue.REPORTS, reliability=ReliabilityPolicy.RELIABLE,
                      durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Topic(NamedTuple):
    """A topic: its relative name, the message, the tuple with the same fields, its QoS."""

    name: str
    message: type
    said: type
    qos: QoSProfile


class Trust(NamedTuple):
    """Confidence in every state, as in the message."""

    run: int
    width: int
    height: int
    confidence: list


class Policy(NamedTuple):
    """Action of every state, as in the message."""

    run: int
    width: int
    height: int
    action: list


class Values(NamedTuple):
    """Value of every state, as in the message."""

    run: int
    width: int
    height: int
    value: list


WORLD = Topic('world', msg.WorldDescription, dialogue.WorldDescription, LATCHED)
STATE = Topic('state', msg.StateReward, dialogue.StateReward, LATCHED)
RECOMMENDATION = Topic('recommendation', msg.Recommendation, dialogue.Recommendation, LATCHED)
ACTION = Topic('action', msg.Action, dialogue.Action, LATCHED)
EPISODE = Topic('episode', msg.Episode, dialogue.Episode, REPORTED)
PROGRESS = Topic('progress', msg.Progress, dialogue.Progress, REPORTED)
TRUST = Topic('trust', msg.Trust, Trust, LATCHED)
POLICY = Topic('policy', msg.Policy, Policy, LATCHED)
VALUES = Topic('values', msg.Values, Values, LATCHED)
MENTOR_POLICY = Topic('mentor_policy', msg.Policy, Policy, LATCHED)

RECOMMEND = 'recommend'  # service of the mentor
SAVE = 'save'  # service of the learner
PAUSE, STEP = '~/pause', '~/step'  # services of the world
RESET = '~/reset'  # service of the world, and of the learner
ANOTHER = 'another learner is meant'  # what it says to who means another


def decoder(topic):
    """Return a function from a message to its tuple."""
    said, names = topic.said, topic.said._fields
    return lambda message: said(*[getattr(message, name) for name in names])


def encoder(topic):
    """Return a function from a tuple to its message: always the same object, filled anew."""
    message, names = topic.message(), topic.said._fields

    def encode(said):
        for name, value in zip(names, said):
            setattr(message, name, value)
        return message
    return encode
