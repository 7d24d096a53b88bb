# SPDX-License-Identifier: Apache-2.0
"""MCAP files, read record by record up to the last complete message, even without an end."""

from collections.abc import Iterator
import mmap
from pathlib import Path
from struct import error as StructError
from struct import Struct, unpack_from
import sys
from zlib import crc32

from lz4.frame import LZ4FrameDecompressor

from comply_ros.bags.bag_message import BagError, BagMessage, first_line, TruncatedFile

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

MAGIC = b'\x89MCAP0\r\n'
RECORD_HEADER = Struct('<BQ')  # opcode, length
SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 0x03, 0x04, 0x05, 0x06, 0x0F
MESSAGE_HEADER = Struct('<HIQQ')  # channel, sequence, log time, publish time
CHUNK_HEADER = Struct('<QQQI')  # first time, last time, uncompressed size, CRC-32
DECOMPRESSORS = {'zstd': zstd.ZstdDecompressor, 'lz4': LZ4FrameDecompressor}

Buffer = mmap.mmap | bytes


def read_mcap(path: Path) -> Iterator[BagMessage]:
    """
    Yield every message of a file, in the order of the file.

    Raises BagError if it is not an MCAP file, OSError if it cannot be read, and TruncatedFile
    after the last complete message if the file has no proper end.
    """
    with path.open('rb') as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        if content[:len(MAGIC)] != MAGIC[:len(content)]:
            raise BagError('an MCAP file must begin with its magic bytes, '
                           f'got {content[:len(MAGIC)]!r}')
        yield from _messages(content)


def _messages(content: Buffer) -> Iterator[BagMessage]:
    schemas: dict[int, tuple] = {}
    channels: dict[int, tuple] = {}
    offset = len(MAGIC)
    try:
        for opcode, body, offset in _records(content, offset):
            if opcode == DATA_END:
                return
            records = _records(_chunk(body), 0) if opcode == CHUNK else ((opcode, body, offset),)
            for inner_opcode, inner_body, _ in records:
                if inner_opcode == MESSAGE:
                    channel, _, time, _ = MESSAGE_HEADER.unpack_from(inner_body)
                    yield BagMessage(*channels[channel], time, inner_body[MESSAGE_HEADER.size:])
                elif inner_opcode == SCHEMA:
                    name, place = _text(inner_body, 2)
                    encoding, place = _text(inner_body, place)
                    text, _ = _text(inner_body, place)
                    schemas[unpack_from('<H', inner_body)[0]] = name, (encoding, text)
                elif inner_opcode == CHANNEL:
                    channel, schema = unpack_from('<HH', inner_body)
                    topic, _ = _text(inner_body, 4)
                    channels[channel] = topic, *schemas.get(schema, ('', ('', '')))
    except (StructError, KeyError, UnicodeDecodeError, zstd.ZstdError, RuntimeError) as error:
        raise TruncatedFile(f'ends early or is damaged near byte {offset} '
                            f'({first_line(error)})') from None
    raise TruncatedFile(f'has no end after byte {offset}')


def _records(content: Buffer, offset: int) -> Iterator[tuple[int, bytes, int]]:
    """Yield opcode, body and end offset of each record; a last chunk as far as it is there."""
    while offset + RECORD_HEADER.size <= len(content):
        opcode, size = RECORD_HEADER.unpack_from(content, offset)
        start = offset + RECORD_HEADER.size
        offset = start + size
        if offset <= len(content) or opcode == CHUNK:
            yield opcode, content[start:offset], min(offset, len(content))
        if offset > len(content):
            break
    if offset != len(content):
        raise TruncatedFile(f'ends in the middle of a record, at byte {len(content)}')


def _chunk(body: bytes) -> bytes:
    """Return the records of a chunk; of a truncated chunk, those that are there."""
    *_, size, checksum = CHUNK_HEADER.unpack_from(body)
    compression, offset = _text(body, CHUNK_HEADER.size)
    compressed_size, = unpack_from('<Q', body, offset)
    content = body[offset + 8:offset + 8 + compressed_size]
    if compression:
        if compression not in DECOMPRESSORS:
            raise TruncatedFile(f'has a chunk with the unsupported compression {compression!r}')
        content = DECOMPRESSORS[compression]().decompress(content)
    if len(content) == size and checksum and crc32(content) != checksum:
        raise TruncatedFile('has a chunk whose checksum is wrong')
    return content


def _text(body: bytes, offset: int) -> tuple[str, int]:
    """Return a text that is preceded by its length, and the offset of its end."""
    size, = unpack_from('<I', body, offset)
    end = offset + 4 + size
    return bytes(body[offset + 4:end]).decode(), end
