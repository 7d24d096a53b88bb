# SPDX-License-Identifier: Apache-2.0
"""MCAP files, read record by record up to the last complete message, even without an end."""

from collections.abc import Iterator
from io import BytesIO
import mmap
from pathlib import Path
from struct import error as StructError

from lz4.frame import LZ4FrameDecompressor
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, McapRecord, Message, Schema
from mcap.stream_reader import (
    breakup_chunk,
    CRCValidationError,
    get_chunk_data_stream,
    StreamReader,
)
from zstandard import ZstdDecompressor, ZstdError

from comply_ros.bags.bag_message import BagError, BagMessage, first_line, TruncatedFile

MAGIC = b'\x89MCAP0\r\n'
COMPRESSIONS = ('', 'zstd', 'lz4')
ENDS = EndOfFile, StructError  # what the library raises where bytes are missing
DAMAGES = (CRCValidationError, KeyError, MemoryError, OverflowError, RuntimeError,
           UnicodeDecodeError, ZstdError)


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
        content.seek(len(MAGIC))
        yield from _messages(content)


def _messages(content: mmap.mmap) -> Iterator[BagMessage]:
    schemas: dict[int, Schema] = {}
    channels: dict[int, tuple] = {}
    try:
        for record in _records(content):
            if isinstance(record, Message):
                yield BagMessage(*channels[record.channel_id], record.log_time, record.data)
            elif isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                schema = schemas.get(record.schema_id, Schema(b'', '', 0, ''))
                channels[record.id] = (record.topic, schema.name,
                                       (schema.encoding, schema.data.decode()))
    except DAMAGES as error:
        raise TruncatedFile(f'ends early or is damaged near byte {content.tell()} '
                            f'({first_line(error)})') from None


def _records(content: mmap.mmap) -> Iterator[McapRecord]:
    """Yield the records before the end of the data, those in chunks too."""
    reader = StreamReader(content, skip_magic=True, emit_chunks=True, record_size_limit=None)
    end = content.tell()  # of the last complete record
    try:
        for record in reader.records:
            if isinstance(record, DataEnd):
                return
            yield from _chunk_records(record) if isinstance(record, Chunk) else (record,)
            end = content.tell()
    except ENDS:  # of the file, or of a chunk that is damaged
        yield from _cut_chunk_records(content[end:])
    if end == len(content):
        raise TruncatedFile(f'has no end after byte {end}')
    raise TruncatedFile(f'ends in the middle of a record, at byte {len(content)}')


def _chunk_records(chunk: Chunk) -> Iterator[McapRecord]:
    """Yield the records in a complete chunk; of a damaged one, those before the damage."""
    _check_compression(chunk)
    try:
        yield from breakup_chunk(chunk, validate_crc=True)
    except (*ENDS, OverflowError):
        yield from _complete_records(get_chunk_data_stream(chunk)[0].read(-1))
        raise


def _cut_chunk_records(content: bytes) -> Iterator[McapRecord]:
    """Yield the complete records in the last record of a file, if it is a chunk that was cut."""
    stream = ReadDataStream(BytesIO(content))
    try:
        opcode, _ = stream.read1(), stream.read8()
        if opcode != Opcode.CHUNK:
            return
        chunk = Chunk.read(stream)
        _check_compression(chunk)
        data = chunk.data
        if chunk.compression:
            decompressor = (ZstdDecompressor().decompressobj() if chunk.compression == 'zstd'
                            else LZ4FrameDecompressor())
            data = decompressor.decompress(data)
        yield from _complete_records(data)
    except ENDS:
        return


def _complete_records(data: bytes) -> Iterator[McapRecord]:
    """Yield the records in the data of a chunk, until one is incomplete."""
    try:
        yield from StreamReader(BytesIO(data), skip_magic=True, record_size_limit=None).records
    except (*ENDS, OverflowError):
        return


def _check_compression(chunk: Chunk) -> None:
    if chunk.compression not in COMPRESSIONS:  # the library takes it for none
        raise TruncatedFile('has a chunk with the unsupported compression '
                            f'{chunk.compression!r}')
