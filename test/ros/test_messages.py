# SPDX-License-Identifier: Apache-2.0
"""Messages and tuples say the same; fields are explained where `ros2 interface show` looks."""

from array import array
from pathlib import Path
import re

import numpy as np
import pytest
from tiny_tables import machine

from comply_ros.nodes import topics
from comply_ros.nodes.topics import decoder, encoder
from comply_ros.protocol import messages
from comply_ros.protocol.world_description import describe_world, world_from_description
from comply_ros.storage.map_files import read_map
from comply_ros.world.state_action_spaces import Spaces

INTERFACES = Path(__file__).parents[2] / 'msg_defs'
TOPICS = [each for each in vars(topics).values() if isinstance(each, topics.Topic)]
SAID = {
    'WorldDescription': describe_world(
        read_map('maze', 'report'), 'maze', 2 ** 32 - 1, 12345678901),
    'StateReward': messages.StateReward(1, 2, 3, 1680, -0.1, False, True),
    'Recommendation': messages.Recommendation(1, 2, 3, 4, -1),
    'Action': messages.Action(1, 2, 3, -1, False, 0.1 + 0.2),
    'Episode': messages.Episode(1, 2, 320, -31.9, False, True),
    'Progress': messages.Progress(1, 2, 400, 15, 2 ** 40, -3.5, 0.25, 0.03, True),
    'Trust': messages.Trust(1, [0.5, 0.25], 'anna'),
    'Values': messages.Values(1, [0.1 + 0.2, -3.5]),
    'LearnerDescription': messages.LearnerDescription(
        1, 2, 3, 'sarsa', '{}', 2 ** 53, True, 64 * 'f'),
    'Policy': messages.Policy(1, [-1, 300]),
}


def test_there_is_an_example_of_everything_that_is_said():
    assert {topic.message.__name__ for topic in TOPICS} == set(SAID)


@pytest.mark.parametrize('topic', TOPICS, ids=lambda topic: topic.name)
def test_a_tuple_has_the_fields_of_its_message(topic):
    assert ['header', *topic.tuple_type._fields] == list(
        topic.message.get_fields_and_field_types())


def as_list(value):
    """Return a list of the elements of anything with elements, and all else as it is."""
    return list(value) if isinstance(value, (tuple, list, array)) else value


@pytest.mark.parametrize('source', [
    machine(), machine(positions=np.array([[0.0, 1.0], [2.0, 3.0], [4.5, -1.0]]),
                       cells=('a', '', 'b')), machine(starts=(1, 0)),
    Spaces(3, ('go', 'wait'), 10), Spaces(2, ('go', 'wait'), 7, np.array([[1, 0], [0, 1]], bool))])
def test_a_world_of_every_model_is_rebuilt_from_its_message(source):
    description = describe_world(source, 'world', 7, 12345678901)
    content = topics.writer(topics.WORLD, lambda: 5)(description)
    from rclpy.serialization import serialize_message
    read = topics.reader(topics.WORLD)(serialize_message(content))
    rebuilt = world_from_description(read)
    assert rebuilt == source and read.began == 12345678901
    assert topics.description_size(description) == len(serialize_message(content))
    if source.sha256 == machine().sha256:
        assert repr(rebuilt.positions) == repr(source.positions)
        assert rebuilt.cells == source.cells


@pytest.mark.parametrize('topic', TOPICS, ids=lambda topic: topic.name)
def test_messages_round_trip_to_the_bit(topic, monkeypatch):
    monkeypatch.setenv('ROS_PYTHON_CHECK_FIELDS', '1')
    from rclpy.serialization import deserialize_message, serialize_message
    msg = SAID[topic.message.__name__]
    sent = serialize_message(encoder(topic)(msg))
    heard = decoder(topic)(deserialize_message(sent, topic.message))
    for name, value, copy in zip(msg._fields, msg, heard):
        if hasattr(value, '_fields'):
            assert list(map(as_list, copy)) == list(map(as_list, value)), name
        elif isinstance(value, (tuple, list, array)):
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
