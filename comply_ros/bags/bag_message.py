# SPDX-License-Identifier: Apache-2.0
"""One message as a bag has it, and what can be wrong with a bag."""

from typing import NamedTuple


class BagError(ValueError):
    """A bag that cannot be used; the message says what is wrong with it."""


class CutOff(Exception):  # noqa: N818
    """The end of what can be read of a file, where more should be; the message says why."""


def in_short(error):
    """Text of an exception, on one line whatever is in it."""
    line = (str(error).splitlines() or [''])[0]
    return (line if line.isprintable() else repr(line)) or type(error).__name__


class BagMessage(NamedTuple):
    """
    A message in its bytes.

    kind: type, as in `comply_msgs/msg/Action`.
    definition: (encoding, text) of that type and of all that it needs.
    time: nanoseconds since 1970 at which it was recorded.
    """

    topic: str
    kind: str
    definition: tuple
    time: int
    content: bytes
