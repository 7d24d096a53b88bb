# SPDX-License-Identifier: Apache-2.0
"""The sqlite3 files of rosbag2, read up to the last complete message."""

from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager
import os
from pathlib import Path
import shutil
import sqlite3
from tempfile import TemporaryDirectory
from urllib.parse import quote

from comply_ros.bags.bag_message import BagError, BagMessage, first_line, TruncatedFile

MAGIC = b'SQLite format 3\0'
HEADER_SIZE = 100  # bytes at the start of every sqlite3 file


def read_sqlite(path: Path) -> Iterator[BagMessage]:
    """
    Yield every message of a file, in the order in which it was recorded.

    Raises BagError if it is not an sqlite3 bag, OSError if it cannot be read, and TruncatedFile
    after the last complete message if pages of the file are missing.
    """
    with path.open('rb') as file:
        header = file.read(HEADER_SIZE)
    if header[:len(MAGIC)] != MAGIC[:len(header)]:
        raise BagError(f'an sqlite3 file must begin with {MAGIC!r}, got {header[:len(MAGIC)]!r}')
    try:
        with _whole_pages(path, header) as whole, closing(
                sqlite3.connect(f'file:{quote(str(whole))}?mode=ro', uri=True)) as database:
            yield from _messages(database, path.stat().st_size < _expected_size(header))
    except sqlite3.DatabaseError as error:
        raise TruncatedFile(f'ends early or is damaged ({first_line(error)})') from None


@contextmanager
def _whole_pages(path: Path, header: bytes) -> Generator[Path]:
    """
    Give a file without the page that is cut off at its end, if there is one: a copy.

    sqlite reads zeros for what is missing of a page, so it would read a message that was cut as a
    whole one with zeros at its end.
    """
    page, size = _page_size(header), path.stat().st_size
    if page == 0 or size % page == 0:
        yield path
        return
    with TemporaryDirectory() as folder:
        whole = Path(folder) / path.name
        shutil.copyfile(path, whole)
        os.truncate(whole, size - size % page)
        yield whole


def _page_size(header: bytes) -> int:
    page = int.from_bytes(header[16:18], 'big')
    return 1 << 16 if page == 1 else page


def _expected_size(header: bytes) -> int:
    """Size of the file according to its header: page size times number of pages."""
    return _page_size(header) * int.from_bytes(header[28:32], 'big') or HEADER_SIZE


def _messages(database: sqlite3.Connection, is_truncated: bool) -> Iterator[BagMessage]:
    database.execute('PRAGMA writable_schema=ON')  # else sqlite rejects a truncated file
    tables = {str(name) for name, in database.execute('SELECT name FROM sqlite_master')}
    if not {'topics', 'messages'} <= tables:
        if is_truncated:
            raise TruncatedFile('ends before its tables')
        raise BagError('an sqlite3 bag must have the tables topics and messages, '
                       f'got {", ".join(sorted(tables)) or "none"}')
    definitions = {}
    if 'message_definitions' in tables:
        definitions = {name: (encoding, text) for name, encoding, text in database.execute(
            'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions')}
    topics = {number: (topic, message_type, definitions.get(message_type, ('', '')))
              for number, topic, message_type in database.execute(
                  'SELECT id, name, type FROM topics')}
    for number, time, data in database.execute(
            'SELECT topic_id, timestamp, data FROM messages ORDER BY id'):
        if number not in topics:
            raise TruncatedFile(f'has a message of topic {number}, which it does not describe')
        yield BagMessage(*topics[number], time, data)
