# SPDX-License-Identifier: Apache-2.0
"""Bags as `ros2 bag record` would write them, with the definition of every message."""

from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

ANY_TIME = QosTime(9223372036, 854775807)  # as rosbag2 writes that there is no limit


def latched(depth):
    """Return the `Qos` of a topic whose last messages stay for who comes late."""
    return Qos(QosHistory.KEEP_LAST, depth, QosReliability.RELIABLE,
               QosDurability.TRANSIENT_LOCAL, ANY_TIME, ANY_TIME, QosLiveliness.AUTOMATIC,
               ANY_TIME, False)


class BagWriter:
    """
    Writes serialized messages to a new bag; to be closed.

    Parameters
    ----------
    path: of the folder, which must not be there yet.
    definitions: text of each message type by its name, and of all types that they need.
    storage: `mcap` or `sqlite3`.

    Attributes
    ----------
    counts: messages that were written, by topic.

    Raises
    ------
    OSError: if it cannot be written.

    """

    def __init__(self, path, definitions, storage='mcap'):
        self._types = get_typestore(Stores.EMPTY)
        known = {}
        for kind, text in definitions.items():
            known.update(get_types_from_msg(text, kind))
        self._types.register(known)
        self._writer = Writer(path, version=Writer.VERSION_LATEST,
                              storage_plugin=StoragePlugin[storage.upper()])
        self._writer.open()
        self._connections, self.counts = {}, {}

    def add(self, topic, kind, qos=()):
        """Add a topic, before its first message."""
        self._connections[topic] = self._writer.add_connection(
            topic, kind, typestore=self._types, offered_qos_profiles=qos)
        self.counts[topic] = 0

    def write(self, topic, time, content):
        """Write one message, recorded at a time in nanoseconds since 1970. Raises OSError."""
        self._writer.write(self._connections[topic], time, content)
        self.counts[topic] += 1

    def flush(self):
        """Have the system take all that was written: a kill loses nothing of it (MCAP only)."""
        storage = self._writer.storage
        if storage.chunk.msgs:  # rosbags itself waits for a mebibyte
            storage.close_chunk()
            storage.bio.flush()

    def close(self):
        """Write the index and the metadata. Raises OSError."""
        self._writer.close()
