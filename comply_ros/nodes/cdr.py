# SPDX-License-Identifier: Apache-2.0
"""
Messages of a fixed size as raw bytes (CDR, the wire format of ROS 2).

rclpy converts every field of a message between Python and C. For the messages of the loop, which
have numbers only, one `struct` call does the same in a tenth of the time.
"""

from collections.abc import Callable
from struct import Struct
from typing import Any, NamedTuple

from rclpy.serialization import deserialize_message

# Struct code and size in bytes of each type; CDR aligns a field to its size.
CODES = {'boolean': ('?', 1), 'int8': ('b', 1), 'uint8': ('B', 1), 'int16': ('h', 2),
         'uint16': ('H', 2), 'int32': ('i', 4), 'uint32': ('I', 4), 'int64': ('q', 8),
         'uint64': ('Q', 8), 'float': ('f', 4), 'double': ('d', 8)}
LITTLE_ENDIAN = b'\x00\x01\x00\x00'  # the header of plain CDR


def layout(message: type[Any]) -> Struct | None:
    """Return the bytes of a message type behind its header, None if its size is not fixed."""
    fields = message.get_fields_and_field_types()
    if not all(kind in CODES for kind in fields.values()):
        return None
    text, end = '', 0
    for kind in fields.values():
        code, size = CODES[kind]
        padding = -end % size
        text += 'x' * padding + code
        end += padding + size
    return Struct(f'<4s{text}' + 'x' * (-end % 4))


def decoder(message: type[Any], tuple_type: type[NamedTuple]) -> Callable[[bytes], Any]:
    """Return a function from the bytes of a message of a fixed size to its tuple."""
    struct, make = layout(message), tuple_type._make
    assert struct is not None
    size, unpack, names = struct.size, struct.unpack_from, tuple_type._fields

    def decode(content: bytes) -> Any:
        if len(content) >= size:
            header, *values = unpack(content)
            if header[:2] == b'\x00\x01':
                return make(values)
        converted = deserialize_message(content, message)  # another encoding of the same message
        return make(getattr(converted, name) for name in names)
    return decode


def encoder(message: type[Any]) -> Callable[[Any], bytes]:
    """Return a function from a tuple to the bytes of a message of a fixed size."""
    struct = layout(message)
    assert struct is not None
    pack = struct.pack
    return lambda values: pack(LITTLE_ENDIAN, *values)
