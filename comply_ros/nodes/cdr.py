# SPDX-License-Identifier: Apache-2.0
"""
Messages of numbers as raw bytes (CDR, the wire format of ROS 2).

rclpy converts every field of a message between Python and C, and a header costs more than all
numbers together. For the messages of the loop, which have a header, numbers and at most a text or
a list of actions at the end, one `struct` call does the same in a tenth of the time.
"""

from array import array
from collections.abc import Callable
from functools import partial
from struct import Struct
from typing import Any, NamedTuple

from rclpy.serialization import deserialize_message

from comply_ros.protocol.messages import NANOSECONDS

# Struct code and size in bytes of each type; CDR aligns a field to its size.
CODES = {'boolean': ('?', 1), 'int8': ('b', 1), 'uint8': ('B', 1), 'int16': ('h', 2),
         'uint16': ('H', 2), 'int32': ('i', 4), 'uint32': ('I', 4), 'int64': ('q', 8),
         'uint64': ('Q', 8), 'float': ('f', 4), 'double': ('d', 8)}
HEADER, TEXT, ACTIONS = 'std_msgs/Header', 'string', 'sequence<int16>'
HEADER_SIZE = 13  # bytes of a header with an empty frame_id: two numbers, a length and a zero
LITTLE_ENDIAN = 0x0100  # the bytes 0 and 1 of plain CDR, as one little-endian number
PLAIN = LITTLE_ENDIAN, 1  # what is unpacked of a message in plain CDR with an empty frame_id

Clock = Callable[[], int]  # nanoseconds since 1970


class Layout(NamedTuple):
    """
    Where the bytes of a message are.

    fields: struct codes of the fields behind the header, and of the length of what is at the end.
    size: in bytes, of all but that.
    end: the type of what is at the end, TEXT or ACTIONS; empty if only numbers are.
    """

    fields: str
    size: int
    end: str


def layout(message: type[Any]) -> Layout | None:
    """Return the layout of a message type, None if there is more in it, or something else."""
    kinds = list(message.get_fields_and_field_types().values())
    last = kinds[-1] if kinds[-1] in (TEXT, ACTIONS) else ''
    numbers = kinds[1:-1] + ['uint32'] if last else kinds[1:]
    if kinds[0] != HEADER or not all(kind in CODES for kind in numbers):
        return None
    text, end = '', HEADER_SIZE
    for kind in numbers:
        code, size = CODES[kind]
        padding = -end % size
        text += 'x' * padding + code
        end += padding + size
    return Layout(text, 4 + end, last)


def decoder(message: type[Any], tuple_type: type[Any]) -> Callable[[bytes], Any]:
    """
    Return a function from the bytes of a message that has a layout to its tuple.

    The header is dropped. Raises whatever rclpy does for bytes that are no such message.
    """
    found, names = layout(message), tuple_type._fields
    assert found is not None
    make = partial(tuple.__new__, tuple_type)  # half the time of `_make`
    size, last = found.size, found.end
    unpack = Struct(f'<H10xIx{found.fields}').unpack_from

    def decode(content: bytes) -> Any:
        if len(content) >= size:
            values = unpack(content)
            if values[:2] == PLAIN:
                if not last:
                    return make(values[2:])
                end = size + values[-1] * (1 if last == TEXT else 2)
                if last == TEXT and size < end <= len(content):
                    return make((*values[2:-1], str(content[size:end - 1], 'utf-8')))
                if last == ACTIONS and end <= len(content):
                    return make((*values[2:-1], actions_in(content[size:end])))
        converted = deserialize_message(content, message)  # another encoding, or a frame_id
        found = [getattr(converted, name) for name in names]
        return make(found[:-1] + [tuple(found[-1])] if last == ACTIONS else found)
    return decode


def actions_in(content: bytes) -> tuple[int, ...]:
    """Return the actions in the bytes of a list of them."""
    return tuple(value for value, in Struct('<h').iter_unpack(content)) if content else ()


def encoder(message: type[Any], clock: Clock) -> Callable[[Any], bytes]:
    """
    Return a function from a tuple to the bytes of a message that has a layout.

    clock: read for the stamp of each message.
    """
    found = layout(message)
    assert found is not None
    pack = Struct(f'<HxxiIIx{found.fields}').pack

    def encode(values: Any) -> bytes:
        return pack(LITTLE_ENDIAN, *divmod(clock(), NANOSECONDS), 1, *values)

    def encode_with_text(values: Any) -> bytes:
        *numbers, text = values
        content = text.encode() + b'\0'
        return pack(LITTLE_ENDIAN, *divmod(clock(), NANOSECONDS), 1, *numbers, len(content)) \
            + content

    def encode_with_actions(values: Any) -> bytes:
        actions = values[-1]
        fixed = pack(LITTLE_ENDIAN, *divmod(clock(), NANOSECONDS), 1, *values[:-1], len(actions))
        return fixed + array('h', actions).tobytes() if actions else fixed
    return {TEXT: encode_with_text, ACTIONS: encode_with_actions}.get(found.end, encode)
