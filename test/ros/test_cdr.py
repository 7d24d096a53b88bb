# SPDX-License-Identifier: Apache-2.0
"""Messages of a fixed size as bytes: the same as rclpy's own conversion, to the bit."""

from comply_msgs.msg import Action, Policy, Progress, Recommendation, StateReward, WorldDescription
from hypothesis import given
from hypothesis import strategies as st
import pytest
from rclpy.serialization import deserialize_message, serialize_message

from comply_ros.nodes import cdr, topics

FIXED = [topics.STATE, topics.ACTION, topics.RECOMMENDATION, topics.EPISODE, topics.PROGRESS]
VALUES = {
    'boolean': st.booleans(), 'double': st.floats(), 'int8': st.integers(-128, 127),
    'uint32': st.integers(0, 2 ** 32 - 1), 'uint64': st.integers(0, 2 ** 64 - 1)}


def tuples(topic):
    """Return a strategy of tuples with any values of their types."""
    return st.builds(topic.tuple_type, **{
        name: VALUES[kind] for name, kind in topic.message.get_fields_and_field_types().items()})


@pytest.mark.parametrize('topic', FIXED, ids=lambda topic: topic.name)
def test_bytes_are_those_of_rclpy_in_both_directions(topic):
    encode, fill = cdr.encoder(topic.message), topics.encoder(topic)
    decode = cdr.decoder(topic.message, topic.tuple_type)

    @given(tuples(topic))
    def check(values):
        content = encode(values)
        expected = serialize_message(fill(values))
        assert len(content) == len(expected) and content[:4] == expected[:4]
        assert repr(decode(content)) == repr(decode(expected)) == repr(values)
        assert repr(topics.decoder(topic)(deserialize_message(content, topic.message))) \
            == repr(values)
    check()


def test_another_encoding_is_left_to_rclpy():
    values = topics.STATE.tuple_type(1, 2, 3, 4, -0.5, False, True, 7)
    big = bytes((0, 0, 0, 0)) + b''.join((
        *(each.to_bytes(4, 'big') for each in (1, 2, 3, 4)), bytes.fromhex('bfe0000000000000'),
        b'\x00\x01\x00\x00', (7).to_bytes(4, 'big')))
    assert cdr.decoder(StateReward, topics.STATE.tuple_type)(big) == values


def test_only_messages_of_numbers_have_a_fixed_size():
    for message in (StateReward, Action, Recommendation, Progress):
        assert cdr.layout(message)
    for message in (WorldDescription, Policy):
        assert cdr.layout(message) is None
