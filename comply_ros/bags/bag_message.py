# SPDX-License-Identifier: Apache-2.0
"""A message as it is stored in a bag, and the errors of a bag."""

from typing import NamedTuple


class BagError(ValueError):
    """A bag that cannot be used; the text says what is wrong with it."""


class TruncatedFile(Exception):
    """A file that ends before its proper end; the text says where."""


def first_line(error: Exception) -> str:
    """Text of an exception as one printable line."""
    line = (str(error).splitlines() or [''])[0]
    return (line if line.isprintable() else repr(line)) or type(error).__name__


class BagMessage(NamedTuple):
    """
    A serialized message.

    message_type: as in `comply_msgs/msg/Action`.
    definition: (encoding, text) of that type and of all types that it needs.
    time: when it was recorded, in nanoseconds since 1970.
    """

    topic: str
    message_type: str
    definition: tuple[str, str]
    time: int
    data: bytes
