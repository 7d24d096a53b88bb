# SPDX-License-Identifier: Apache-2.0
"""The sqlite3 files of rosbag2, read up to the last whole message."""

from contextlib import closing
import sqlite3
from urllib.parse import quote

from comply_ros.bags.bag_message import BagError, BagMessage, CutOff, in_short

MAGIC = b'SQLite format 3\0'
HEAD = 100  # bytes at the start of every sqlite3 file


def read_sqlite(path):
    """
    Yield every `BagMessage` message of a file, in the order in which it was recorded.

    Raises
    ------
    CutOff: after the last whole message, if pages of the file are missing.
    BagError: if it is no sqlite3 file of a bag.
    OSError: if it cannot be read.

    """
    with path.open('rb') as file:
        start = file.read(HEAD)
    if not start:
        raise CutOff('is empty')
    if start[:len(MAGIC)] != MAGIC[:len(start)]:
        raise BagError(f'an sqlite3 file must begin with {MAGIC!r}, got {start[:len(MAGIC)]!r}')
    try:
        with closing(sqlite3.connect(f'file:{quote(str(path))}?mode=ro', uri=True)) as base:
            yield from _messages(base, path.stat().st_size < _size(start))
    except sqlite3.DatabaseError as error:
        raise CutOff(f'ends in the middle or is damaged ({in_short(error)})') from None


def _size(start):
    """Return the bytes that a file must have, by its head: page size and number of pages."""
    page = int.from_bytes(start[16:18], 'big')
    return (1 << 16 if page == 1 else page) * int.from_bytes(start[28:32], 'big') or HEAD


def _messages(base, is_short):
    base.execute('PRAGMA writable_schema=ON')  # else sqlite refuses a file that is too short
    tables = {str(name) for name, in base.execute('SELECT name FROM sqlite_master')}
    if is_short and not {'topics', 'messages'} <= tables:
        raise CutOff('ends before its tables')
    if not {'topics', 'messages'} <= tables:
        raise BagError('an sqlite3 bag must have the tables topics and messages, '
                       f'got {", ".join(sorted(tables)) or "none"}')
    definitions = {}
    if 'message_definitions' in tables:
        definitions = {kind: (encoding, text) for kind, encoding, text in base.execute(
            'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions')}
    topics = {number: (name, kind, definitions.get(kind, ('', '')))
              for number, name, kind in base.execute('SELECT id, name, type FROM topics')}
    for number, time, content in base.execute(
            'SELECT topic_id, timestamp, data FROM messages ORDER BY id'):
        if number not in topics:
            raise CutOff(f'has a message of topic {number}, which it does not describe')
        yield BagMessage(*topics[number], time, content)
