# SPDX-License-Identifier: Apache-2.0
"""Bags: read as they were written, by others too, up to the last whole message, never beyond."""

import shutil
import subprocess
import sys

from bag_fixtures import Held, write
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2.decoder import DecoderFactory
import pytest
from rosbags.highlevel import AnyReader

from comply_ros.bags import replay
from comply_ros.bags.bag_message import BagError
from comply_ros.bags.bag_reader import Bag
from comply_ros.bags.message_decoder import DecodedMessages

STORAGES = {'mcap': '.mcap', 'sqlite3': '.db3'}


@pytest.fixture(scope='module')
def spoken():
    """Return what was said in a short conversation."""
    return Held(iterations=2, episodes=6).spoken


@pytest.fixture(scope='module', params=STORAGES)
def bag(request, spoken, tmp_path_factory):
    """Return the path of a bag of it."""
    return write(tmp_path_factory.mktemp('bags') / 'bag', spoken, request.param, flushes=50)


def listed(msg):
    """Return what was said with lists for tuples, and trust as narrow as in its message."""
    return [(topic, [list(each) if type(each) is tuple else each for each in tuple_])
            for topic, tuple_ in msg if topic != 'trust']


def file_of(bag):
    """Return the one file of a bag that has its messages."""
    path, = [each for each in bag.iterdir() if each.suffix in STORAGES.values()]
    return path


def test_what_is_read_is_what_was_written(bag, spoken):
    whole = Bag(bag)
    assert listed(DecodedMessages(whole)) == listed(spoken)
    assert (whole.cut, whole.count, whole.expected) == (None, len(spoken), len(spoken))


def test_a_file_is_read_without_its_folder(bag, spoken, tmp_path):
    path = shutil.copy(file_of(bag), tmp_path / file_of(bag).name)
    assert listed(DecodedMessages(Bag(path))) == listed(spoken)


def test_a_bag_in_several_files_is_read_in_their_order(spoken, tmp_path):
    (tmp_path / 'bag').mkdir()
    size = len(spoken) // 11 + 1
    for number in range(11):
        part = write(tmp_path / f'part{number}', spoken[number * size:(number + 1) * size])
        shutil.copy(file_of(part), tmp_path / 'bag' / f'bag_{number}.mcap')
    assert listed(DecodedMessages(Bag(tmp_path / 'bag'))) == listed(spoken)


@pytest.mark.parametrize('share', range(0, 100, 4))
def test_a_bag_cut_off_anywhere_is_read_up_to_the_last_whole_message(
        bag, spoken, tmp_path, share):
    source = file_of(bag)
    size = source.stat().st_size * share // 100 + share
    path = tmp_path / source.name
    path.write_bytes(source.read_bytes()[:size])
    cut = Bag(path)
    read = list(cut)
    whole = list(Bag(bag))
    assert read == whole[:len(read)]
    assert source.name in cut.cut if len(read) < len(whole) else share > 70  # in the index
    assert len(read) >= len(spoken) * (share - 30) / 100  # definitions and indices have a part


@pytest.mark.parametrize('share', [20, 40, 60])
def test_what_was_said_before_the_cut_is_proven(bag, spoken, tmp_path, share, capsys):
    shutil.copytree(bag, tmp_path / 'bag')
    path = file_of(tmp_path / 'bag')
    path.write_bytes(path.read_bytes()[:path.stat().st_size * share // 100])
    assert replay.main(['replay', str(tmp_path / 'bag')]) == 0
    msg = capsys.readouterr()
    assert 'its learning had not ended' in msg.out
    assert 'was cut off: ' in msg.err and 'read up to the last whole message, ' in msg.err


def test_a_flipped_byte_is_no_traceback(bag, tmp_path):
    content = bytearray(file_of(bag).read_bytes())
    path = tmp_path / file_of(bag).name
    for place in range(0, len(content), len(content) // 60):
        path.write_bytes(content[:place] + bytes([content[place] ^ 0xff]) + content[place + 1:])
        try:
            list(DecodedMessages(Bag(path)))
        except BagError as error:
            assert '\n' not in str(error)


@pytest.mark.parametrize('compression', [CompressionType.ZSTD, CompressionType.LZ4])
def test_compressed_chunks_are_read_and_cut_off_too(spoken, tmp_path, compression):
    path, size = tmp_path / 'a.mcap', 0
    with path.open('wb') as file:
        writer, channels = McapWriter(file, chunk_size=5000, compression=compression), {}
        writer.start('ros2')
        for each in Bag(write(tmp_path / 'bag', spoken)):
            if each.topic not in channels:
                schema = writer.register_schema(each.kind, 'ros2msg',
                                                each.definition[1].encode())
                channels[each.topic] = writer.register_channel(each.topic, 'cdr', schema)
            writer.add_message(channels[each.topic], each.time, each.content, each.time)
        writer.finish()
        size = file.tell()
    whole = Bag(path)
    assert listed(DecodedMessages(whole)) == listed(spoken) and whole.cut is None
    path.write_bytes(path.read_bytes()[:size // 2])
    read = list(DecodedMessages(whole))
    assert whole.cut and listed(read) == listed(spoken[:len(read)]) and len(read) > 50


def test_a_bag_is_read_by_rosbags_where_our_messages_are_not_known(bag, spoken):
    code = (f'import sys; sys.modules["comply_msgs"] = None; from pathlib import Path;'
            f'from rosbags.highlevel import AnyReader\n'
            f'with AnyReader([Path({str(bag)!r})]) as reader:\n'
            f'    said = [reader.deserialize(raw, each.msgtype) '
            f'for each, _, raw in reader.messages()]\n'
            f'    print(len(said), said[0].name)')
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          check=False)
    assert done.stdout == f'{len(spoken)} bar_grid\n', done.stderr
    with AnyReader([bag]) as reader:
        assert reader.topics['/action'].msgtype == 'comply_msgs/msg/Action'


def test_an_mcap_bag_is_read_by_the_library_of_its_makers(spoken, tmp_path):
    path = file_of(write(tmp_path / 'bag', spoken))
    with path.open('rb') as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        msg = [(channel.topic, message)
                for _, channel, _, message in reader.iter_decoded_messages()]
    assert len(msg) == len(spoken)
    actions = [message for topic, message in msg if topic == '/action']
    mine = [each for topic, each in spoken if topic == 'action']
    assert [(each.step, each.action, each.confidence) for each in actions] == [
        (each.step, each.action, each.confidence) for each in mine]


def bad(folder, name):
    """Return the path of something that is no bag of a conversation."""
    path = folder / name
    if name == 'empty':
        path.mkdir()
    elif name == 'mute':
        write(path, [])
    elif name == 'packed':
        path.mkdir()
        (path / 'a.mcap.zstd').write_bytes(b'1')
    elif name != 'nothing':
        path.write_bytes(b'' if name.startswith('hollow') else b'it is a text, and no bag')
    return path


@pytest.mark.parametrize('name, message', [
    ('nothing', "there is no bag '{0}'"),
    ('empty', "a bag must have files that end in .mcap or .db3, and '{0}' has none"),
    ('packed', "a bag must have files that end in .mcap or .db3, and '{0}' has compressed ones: "
     'unzstd them first'),
    ('a.txt', "a bag must be a folder, or a file that ends in .mcap or .db3, got '{0}'"),
    ('a.mcap', 'a.mcap: an MCAP file must begin with its magic bytes, got '
     "b'it is a '"),
    ('a.db3', "a.db3: an sqlite3 file must begin with b'SQLite format 3\\x00', got "
     "b'it is a text, an'"),
    ('hollow.mcap', "bag '{0}' must have a world, and has none among its 0 messages "
     '(hollow.mcap is empty)'),
    ('mute', "bag '{0}' must have a world, and has none among its 0 messages")])
@pytest.mark.parametrize('command', ['replay', 'plot'])
def test_what_is_no_bag_is_one_sentence(tmp_path, capsys, command, name, message):
    from comply_ros.bags import plot
    path = bad(tmp_path, name)
    assert {'replay': replay, 'plot': plot}[command].main([command, str(path)]) == 2
    assert capsys.readouterr().err == f'{command}: {message.format(path)}\n'
