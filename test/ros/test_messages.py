# SPDX-License-Identifier: Apache-2.0
"""Messages and tuples say the same; fields are explained where `ros2 interface show` looks."""

from pathlib import Path
import re

import numpy as np
import pytest

from comply_ros.nodes import topics
from comply_ros.nodes.topics import decoder, encoder
from comply_ros.protocol import messages
from comply_ros.storage.map_files import read_map

INTERFACES = Path(__file__).parents[2] / 'msg_defs'
TOPICS = [each for each in vars(topics).values() if isinstance(each, topics.Topic)]
SAID = {
    'WorldDescription': messages.describe_world(read_map('maze', 'report'), 'maze', 2 ** 32 - 1),
    'StateReward': messages.StateReward(1, 2, 3, 1680, -0.1, False, True),
    'Recommendation': messages.Recommendation(1, 2, 3, 4, -1),
    'Action': messages.Action(1, 2, 3, -1, False, 0.1 + 0.2),
    'Episode': messages.Episode(1, 2, 320, -31.9, False, True),
    'Progress': messages.Progress(1, 2, 400, 15, 2 ** 40, -3.5, 0.25, 0.03, True),
    'Trust': messages.Trust(1, 2, 1, [0.5, 0.25]),
    'Values': messages.Values(1, 2, 1, [0.1 + 0.2, -3.5]),
    'LearnerDescription': messages.LearnerDescription(
        1, 2, 3, 'sarsa', '{}', 2 ** 53, True, 64 * 'f'),
    'Policy': messages.Policy(1, 2, 1, [-1, 3]),
}


def test_there_is_an_example_of_everything_that_is_said():
    assert {topic.message.__name__ for topic in TOPICS} == set(SAID)


@pytest.mark.parametrize('topic', TOPICS, ids=lambda topic: topic.name)
def test_a_tuple_has_the_fields_of_its_message(topic):
    assert list(topic.tuple_type._fields) == list(topic.message.get_fields_and_field_types())


@pytest.mark.parametrize('topic', TOPICS, ids=lambda topic: topic.name)
def test_messages_round_trip_to_the_bit(topic, monkeypatch):
    monkeypatch.setenv('ROS_PYTHON_CHECK_FIELDS', '1')
    from rclpy.serialization import deserialize_message, serialize_message
    msg = SAID[topic.message.__name__]
    sent = serialize_message(encoder(topic)(msg))
    heard = decoder(topic)(deserialize_message(sent, topic.message))
    for name, value, copy in zip(msg._fields, msg, heard):
        if isinstance(value, (tuple, list)):
            assert list(copy) == list(value), name
        else:
            assert copy == value and type(copy) is type(value), name


def test_a_reward_is_not_narrowed():
    message = encoder(topics.STATE)(SAID['StateReward']._replace(reward=0.1 + 0.2))
    assert message.reward == 0.30000000000000004


def test_numpy_scalars_are_not_said():
    for msg in SAID.values():
        assert not any(isinstance(value, np.generic) for value in msg)


@pytest.mark.parametrize('path', sorted(INTERFACES.glob('*/*')), ids=lambda path: path.name)
def test_every_field_has_a_comment(path):
    lines = path.read_text().splitlines()
    assert lines[0].startswith('# ')
    fields = [line for line in lines if re.match(r'[a-z][\w\[\]/]* +\w+', line)
              and '=' not in line.split('#')[0]]
    assert fields
    for line in fields:
        assert re.search(r' # \S+', line), line
