# SPDX-License-Identifier: Apache-2.0
"""MCAP files that are cut off keep every message that is complete, in a cut chunk too."""

from bag_fixtures import SimulatedRun, write_bag
from mcap.writer import CompressionType, Writer
import numpy as np
import pytest

from comply_ros.bags.bag_message import TruncatedFile
from comply_ros.bags.mcap_file import read_mcap


@pytest.fixture(scope='module')
def recorded(tmp_path_factory):
    """Return the messages of a short training as they are in a bag."""
    path = write_bag(tmp_path_factory.mktemp('bags') / 'bag',
                     SimulatedRun(iterations=1, episodes=3).messages)
    return list(read_mcap(next(path.glob('*.mcap'))))


def write(path, messages, compression, **settings):
    """Write an MCAP file with the library itself."""
    with path.open('wb') as file:
        writer, channels = Writer(file, compression=compression, **settings), {}
        writer.start('ros2')
        for each in messages:
            if each.topic not in channels:
                schema = writer.register_schema(each.message_type, each.definition[0],
                                                each.definition[1].encode())
                channels[each.topic] = writer.register_channel(each.topic, 'cdr', schema)
            writer.add_message(channels[each.topic], each.time, each.data, each.time)
        writer.finish()


def read(path):
    """Return the messages of a file, and the reason why there are no more."""
    messages = []
    try:
        for each in read_mcap(path):
            messages.append(each)
    except TruncatedFile as error:
        return messages, str(error)
    return messages, None


@pytest.mark.parametrize('settings', [{'use_chunking': False}, {'chunk_size': 2000},
                                      {'chunk_size': 10_000_000}], ids=str)
def test_every_message_that_ends_before_the_cut_is_kept(recorded, tmp_path, settings):
    path = tmp_path / 'a.mcap'
    write(path, recorded, CompressionType.NONE, **settings)
    content, ends, place = path.read_bytes(), [], 0
    for each in recorded:  # the data of a message is the end of its record
        place = content.index(each.data, place) + len(each.data)
        ends.append(place)
    for size in range(ends[0] - 5, ends[-1], 97):
        path.write_bytes(content[:size])
        kept, reason = read(path)
        assert kept == recorded[:sum(end <= size for end in ends)]
        assert reason.startswith(('ends in the middle of a record, at byte ', 'has no end after'))


@pytest.mark.parametrize('compression', [CompressionType.ZSTD, CompressionType.LZ4])
def test_a_compressed_chunk_that_is_cut_gives_its_whole_blocks(recorded, tmp_path, compression):
    path = tmp_path / 'a.mcap'
    generator = np.random.default_rng(0)  # what it draws cannot be compressed
    messages = [each._replace(data=generator.bytes(20_000)) for each in recorded]
    write(path, messages, compression, chunk_size=100_000_000)  # one chunk, many blocks
    content = path.read_bytes()
    path.write_bytes(content[:len(content) // 2])
    kept, reason = read(path)
    assert len(messages) // 3 < len(kept) < len(messages) and kept == messages[:len(kept)]
    assert reason.startswith('ends in the middle of a record')


def test_an_unknown_compression_is_named(recorded, tmp_path):
    path = tmp_path / 'a.mcap'
    write(path, recorded, CompressionType.ZSTD)
    path.write_bytes(path.read_bytes().replace(b'\x04\0\0\0zstd', b'\x04\0\0\0zstx', 1))
    assert read(path) == ([], "has a chunk with the unsupported compression 'zstx'")
