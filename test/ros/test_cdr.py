# SPDX-License-Identifier: Apache-2.0
"""Messages of numbers as bytes: the same as rclpy's own conversion, to the bit."""

from array import array

from builtin_interfaces.msg import Time
from comply_msgs.msg import Action, Progress, Recommendation, StateReward, WorldDescription
from hypothesis import given
from hypothesis import strategies as st
import pytest
from rclpy.serialization import deserialize_message, serialize_message

from comply_ros.nodes import cdr, topics
from examples import examples

STAMP = 5 * 10 ** 9 + 7  # nanoseconds
FIXED = [topics.STATE, topics.ACTION, topics.RECOMMENDATION, topics.EPISODE, topics.PROGRESS]
VALUES = {
    'boolean': st.booleans(), 'double': st.floats(),
    'int16': st.integers(-2 ** 15, 2 ** 15 - 1), 'string': st.text(
        st.characters(exclude_categories=['Cs'], exclude_characters='\0'), max_size=9),
    'uint16': st.integers(0, 2 ** 16 - 1), 'sequence<int16>': st.lists(
        st.integers(-2 ** 15, 2 ** 15 - 1), max_size=16).map(tuple),
    'uint32': st.integers(0, 2 ** 32 - 1), 'uint64': st.integers(0, 2 ** 64 - 1)}


def tuples(topic):
    """Return a strategy of tuples with any values of their types."""
    return st.builds(topic.tuple_type, **{
        name: VALUES[kind] for name, kind in topic.message.get_fields_and_field_types().items()
        if name != 'header'})


def with_tuples(values):
    """Return a tuple of rclpy's conversion, with tuples instead of arrays."""
    return values._make(tuple(each) if isinstance(each, array) else each for each in values)


@pytest.mark.parametrize('topic', FIXED, ids=lambda topic: topic.name)
def test_bytes_are_those_of_rclpy_in_both_directions(topic):
    encode, fill = cdr.encoder(topic.message, lambda: STAMP), topics.encoder(topic)
    decode = cdr.decoder(topic.message, topic.tuple_type)

    @given(tuples(topic))
    @examples(100)
    def check(values):
        content = encode(values)
        message = fill(values)
        message.header.stamp = Time(sec=5, nanosec=7)
        expected = serialize_message(message)
        assert len(content) == len(expected) and content[:4] == expected[:4]
        assert repr(decode(content)) == repr(decode(expected)) == repr(values)
        converted = topics.decoder(topic)(deserialize_message(content, topic.message))
        assert repr(with_tuples(converted)) == repr(values)
    check()


def test_another_encoding_is_left_to_rclpy():
    values = topics.STATE.tuple_type(1, 2, 3, 4, -0.5, False, True, 7)
    big = bytes((0, 0, 0, 0)) + b''.join((
        (5).to_bytes(4, 'big'), (7).to_bytes(4, 'big'), (1).to_bytes(4, 'big'), bytes(4),
        *(each.to_bytes(4, 'big') for each in (1, 2, 3, 4)), bytes.fromhex('bfe0000000000000'),
        b'\x00\x01\x00\x00', (7).to_bytes(4, 'big')))
    assert cdr.decoder(StateReward, topics.STATE.tuple_type)(big) == values


@pytest.mark.parametrize('frame', ['a', 'map', 'a_long_frame'])
def test_a_message_with_a_frame_is_left_to_rclpy(frame):
    values = topics.RECOMMENDATION.tuple_type(1, 2, 3, 4, -1, 'anna')
    message = topics.encoder(topics.RECOMMENDATION)(values)
    message.header.frame_id = frame
    read = topics.reader(topics.RECOMMENDATION)(serialize_message(message))
    assert read == values


def test_bytes_that_are_no_message_are_rejected_with_their_size():
    old = bytes.fromhex('00010000') + bytes(range(1, 33))  # a StateReward had 36 bytes once
    with pytest.raises(topics.MessageError) as error:
        topics.reader(topics.STATE)(old)
    assert str(error.value) == (
        'a message on state must be a StateReward of protocol 3, got 36 bytes that are none: is '
        'its publisher of another version of comply_ros?')


def test_a_world_that_is_too_large_is_rejected_with_its_size():
    with pytest.raises(topics.MessageError, match='must have at most 64 MiB, got 65.0 MiB'):
        topics.reader(topics.WORLD)(bytes(65 * 2 ** 20))


def test_only_messages_of_numbers_and_a_text_or_a_few_actions_are_converted_without_rclpy():
    for message in (StateReward, Action, Recommendation, Progress):
        assert cdr.layout(message)
    assert cdr.layout(WorldDescription) is None
    assert not topics.POLICY.raw and not topics.MENTOR_POLICY.raw  # an array of all states
