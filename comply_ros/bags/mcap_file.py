# SPDX-License-Identifier: Apache-2.0
"""MCAP files, read record by record up to the last whole message, whatever is missing."""

import mmap
from struct import error as StructError
from struct import Struct, unpack_from
import sys
from zlib import crc32

from lz4.frame import LZ4FrameDecompressor

from comply_ros.bags.bag_message import BagError, BagMessage, CutOff, in_short

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

MAGIC = b'\x89MCAP0\r\n'
HEAD = Struct('<BQ')  # opcode and length of a record
SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 0x03, 0x04, 0x05, 0x06, 0x0F
MESSAGE_HEAD = Struct('<HIQQ')  # channel, sequence, time of the log, time of publishing
CHUNK_HEAD = Struct('<QQQI')  # first time, last time, size, CRC-32
DECOMPRESSORS = {'zstd': zstd.ZstdDecompressor, 'lz4': LZ4FrameDecompressor}


def read_mcap(path):
    """
    Yield every `BagMessage` message of a file, in the order of the file.

    Raises
    ------
    CutOff: after the last whole message, if the file has no proper end.
    BagError: if it is no MCAP file.
    OSError: if it cannot be read.

    """
    with path.open('rb') as file:
        if not file.read(1):
            raise CutOff('is empty')
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            if content[:len(MAGIC)] != MAGIC[:len(content)]:
                raise BagError('an MCAP file must begin with its magic bytes, '
                               f'got {content[:len(MAGIC)]!r}')
            yield from _messages(content)


def _messages(content):
    schemas, channels, place = {}, {}, len(MAGIC)
    try:
        for opcode, body, place in _records(content, place):
            if opcode == DATA_END:
                return
            inner = _records(_chunk(body), 0) if opcode == CHUNK else ((opcode, body, place),)
            for each in inner:
                yield from _take(each[0], each[1], schemas, channels)
    except (StructError, KeyError, UnicodeDecodeError, zstd.ZstdError, RuntimeError) as error:
        raise CutOff(f'ends in the middle or is damaged near byte {place} '
                     f'({in_short(error)})') from None
    raise CutOff(f'has no end after byte {place}')


def _records(content, place):
    """Yield (opcode, body, place behind it) of each record; of the last, what is there."""
    while place + HEAD.size <= len(content):
        opcode, size = HEAD.unpack_from(content, place)
        start = place + HEAD.size
        place = start + size
        whole = place <= len(content)
        if whole or opcode == CHUNK:
            yield opcode, content[start:place], min(place, len(content))
        if not whole:
            raise CutOff(f'ends in the middle of a record, at byte {len(content)}')
    if place < len(content):
        raise CutOff(f'ends in the middle of a record, at byte {len(content)}')


def _chunk(body):
    """Return the records in a chunk, as bytes: of one that was cut off, those that are there."""
    *_, size, checksum = CHUNK_HEAD.unpack_from(body)
    compression, place = _text(body, CHUNK_HEAD.size)
    compressed, = unpack_from('<Q', body, place)
    content = body[place + 8:place + 8 + compressed]
    if compression:
        if compression not in DECOMPRESSORS:
            raise CutOff(f'has a chunk that is compressed by {compression!r}, which is not read')
        content = DECOMPRESSORS[compression]().decompress(content)
    if len(content) == size and checksum and crc32(content) != checksum:
        raise CutOff('has a chunk that does not fit its checksum')
    return content


def _take(opcode, body, schemas, channels):
    """Yield the message of a record, if it is one; change the tables if it belongs there."""
    if opcode == MESSAGE:
        channel, _, time, _ = MESSAGE_HEAD.unpack_from(body)
        yield BagMessage(*channels[channel], time, body[MESSAGE_HEAD.size:])
    elif opcode == SCHEMA:
        name, place = _text(body, 2)
        encoding, place = _text(body, place)
        schemas[unpack_from('<H', body)[0]] = name, (encoding, _text(body, place)[0])
    elif opcode == CHANNEL:
        number, schema = unpack_from('<HH', body)
        channels[number] = _text(body, 4)[0], *schemas.get(schema, ('', ('', '')))


def _text(body, place):
    """Return a text that is preceded by its length, and the place behind it."""
    size, = unpack_from('<I', body, place)
    return bytes(body[place + 4:place + 4 + size]).decode(), place + 4 + size
