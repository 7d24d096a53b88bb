# SPDX-License-Identifier: Apache-2.0
"""Bags as `ros2 bag record` writes them, with the definition of every message type."""

from collections.abc import Mapping, Sequence
from errno import EEXIST
from pathlib import Path
from typing import Any

import numpy as np
from rosbags import interfaces as rosbag
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.storage_mcap import McapWriter
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

UNLIMITED = rosbag.QosTime(9223372036, 854775807)  # rosbag2's value for a duration without a limit


def latched(depth: int) -> rosbag.Qos:
    """Return the QoS of a topic that sends its last messages to late subscribers."""
    return rosbag.Qos(
        rosbag.QosHistory.KEEP_LAST, depth, rosbag.QosReliability.RELIABLE,
        rosbag.QosDurability.TRANSIENT_LOCAL, UNLIMITED, UNLIMITED,
        rosbag.QosLiveliness.AUTOMATIC, UNLIMITED, False)


class BagWriter:
    """
    Writes serialized messages to a new bag, until it is closed; OSError if it cannot be written.

    path: of the folder, which must not exist yet.
    definitions: text of each message type by its name, and of all types that they need.
    storage: `mcap` or `sqlite3`.
    counts: messages written, by topic.
    """

    def __init__(self, path: Path, definitions: Mapping[str, str], storage: str = 'mcap') -> None:
        if path.exists():  # rosbags raises an error of its own
            raise FileExistsError(EEXIST, 'exists already', str(path))
        self._types = get_typestore(Stores.EMPTY)
        self.define(definitions)
        self._writer = Writer(path, version=Writer.VERSION_LATEST,
                              storage_plugin=StoragePlugin[storage.upper()])
        self._writer.open()
        self._connections: dict[str, rosbag.Connection] = {}
        self.counts: dict[str, int] = {}

    def define(self, definitions: Mapping[str, str]) -> None:
        """Add message types: the text of each by its name, and of all types that they need."""
        types = {}
        for message_type, text in definitions.items():
            types.update(get_types_from_msg(text, message_type))
        self._types.register(types)

    def add(self, topic: str, message_type: str, qos: Sequence[rosbag.Qos] = ()) -> None:
        """Add a topic, before its first message."""
        self._connections[topic] = self._writer.add_connection(
            topic, message_type, typestore=self._types, offered_qos_profiles=qos)
        self.counts[topic] = 0

    def write(self, topic: str, time: int, data: bytes) -> None:
        """Write one message, recorded at a time in nanoseconds since 1970. Raises OSError."""
        self._writer.write(self._connections[topic], time, data)
        self.counts[topic] += 1

    def serialized(self, message_type: str, message: Any) -> bytes:
        """
        Return the bytes of a message, of exactly its length.

        What rclpy makes of one can be longer, and is rejected by readers that look at that.

        message: any object with the fields of the type, also within it.
        """
        return bytes(self._types.serialize_cdr(self._typed(message_type, message), message_type))

    def _typed(self, message_type: str, message: Any) -> Any:
        """Return a message as the type that rosbags has of it."""
        values = {}
        for name, (kind, detail) in self._types.fielddefs[message_type][1]:
            value = getattr(message, name)
            if kind == rosbag.Nodetype.NAME:
                value = self._typed(detail, value)
            elif kind != rosbag.Nodetype.BASE:
                inner, element = detail[0]
                if inner == rosbag.Nodetype.NAME:
                    value = [self._typed(element, each) for each in value]
                else:
                    value = list(value) if element[0] == 'string' else np.array(value, element[0])
            values[name] = value
        return self._types.types[message_type](**values)

    def flush(self) -> None:
        """Write all messages to the file, so that a kill loses none of them (MCAP only)."""
        storage = self._writer.storage
        if isinstance(storage, McapWriter) and storage.chunk.msgs:  # rosbags waits for a mebibyte
            storage.close_chunk()
            storage.bio.flush()

    def close(self) -> None:
        """Write the index and the metadata. Raises OSError."""
        self._writer.close()
