# SPDX-License-Identifier: Apache-2.0
"""Bags are read as they were written, by other libraries too, up to the last whole message."""

from array import array
import shutil
import subprocess
import sys

from bag_fixtures import DEFINITIONS, OLD_DEFINITIONS, SimulatedRun, write_bag
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2.decoder import DecoderFactory
import pytest
from rosbags.highlevel import AnyReader

from comply_ros.bags import replay
from comply_ros.bags.bag_message import BagError
from comply_ros.bags.bag_reader import Bag
from comply_ros.bags.message_decoder import DecodedMessages, topic_kind
from comply_ros.protocol.world_description import is_same_world

STORAGES = {'mcap': '.mcap', 'sqlite3': '.db3'}


@pytest.fixture(scope='module')
def messages():
    """Return the messages of a short training."""
    return SimulatedRun(iterations=2, episodes=6).messages


@pytest.fixture(scope='module', params=STORAGES)
def bag(request, messages, tmp_path_factory):
    """Return the path of a bag of it."""
    return write_bag(tmp_path_factory.mktemp('bags') / 'bag', messages, request.param, chunk=50)


@pytest.fixture(scope='module')
def recorded(bag):
    """Return what is read of the whole bag."""
    return list(Bag(bag))


def listed(messages):
    """Return messages with lists for tuples, but for trust, which a bag has as float32."""
    return [(topic, as_list(msg)) for topic, msg in messages if topic != 'trust']


def as_list(value):
    """Return a list of lists of anything with elements, and all else as it is."""
    return list(map(as_list, value)) if isinstance(value, (tuple, list, array)) else value


def file_of(bag):
    """Return the one file of a bag that has its messages."""
    path, = [each for each in bag.iterdir() if each.suffix in STORAGES.values()]
    return path


def test_what_is_read_is_what_was_written(bag, messages):
    whole = Bag(bag)
    assert listed(DecodedMessages(whole)) == listed(messages)
    assert (whole.truncation, whole.count, whole.expected_count) == (
        None, len(messages), len(messages))


def test_a_file_is_read_without_its_folder(bag, messages, tmp_path):
    path = shutil.copy(file_of(bag), tmp_path / file_of(bag).name)
    assert listed(DecodedMessages(Bag(path))) == listed(messages)


def test_a_bag_in_several_files_is_read_in_their_order(messages, tmp_path):
    (tmp_path / 'bag').mkdir()
    size = len(messages) // 3 + 1
    for place, number in enumerate((0, 2, 10)):  # as words, 10 is before 2
        part = write_bag(tmp_path / f'part{number}', messages[place * size:(place + 1) * size])
        shutil.copy(file_of(part), tmp_path / 'bag' / f'bag_{number}.mcap')
    assert listed(DecodedMessages(Bag(tmp_path / 'bag'))) == listed(messages)


def test_a_namespace_must_be_chosen_where_several_have_a_world(messages, tmp_path):
    (tmp_path / 'bag').mkdir()
    for number, namespace in enumerate(('', '/second')):
        part = write_bag(tmp_path / f'part{number}', messages[number:], namespace=namespace)
        shutil.copy(file_of(part), tmp_path / 'bag' / f'bag_{number}.mcap')
    assert listed(DecodedMessages(Bag(tmp_path / 'bag'))) == listed(messages)
    part = write_bag(tmp_path / 'part', messages, namespace='/third')
    shutil.copy(file_of(part), tmp_path / 'bag' / 'bag_2.mcap')
    with pytest.raises(BagError, match='choose one of /, /third with --namespace'):
        DecodedMessages(Bag(tmp_path / 'bag'))
    assert listed(DecodedMessages(Bag(tmp_path / 'bag'), '/')) == listed(messages)
    assert listed(DecodedMessages(Bag(tmp_path / 'bag'), 'third/')) == listed(messages)


def test_a_bag_of_version_0_1_0_is_read_and_replayed(messages, tmp_path, capsys):
    old = write_bag(tmp_path / 'bag', messages, definitions=OLD_DEFINITIONS)
    read = list(DecodedMessages(Bag(old)))
    assert [topic for topic, _ in read] == [topic for topic, _ in messages]
    assert [msg for topic, msg in read if topic != 'trust' and topic != 'world'] == [
        msg for topic, msg in messages if topic != 'trust' and topic != 'world']
    (_, world), (_, written) = read[0], messages[0]
    assert world.sha256 == '' and is_same_world(world, written)
    assert replay.main(['replay', str(old)]) == 0
    assert ' actions' in capsys.readouterr().out


def definitions_of_protocol_2():
    """Return the texts of the messages of protocol 2, which have no lists of mentors."""
    later = {'Action': ('uint16 mentor ', 'int16[] all_advice '),
             'LearnerDescription': ('string[] mentors ',)}
    return {name: '\n'.join(line for line in text.splitlines() if not line.startswith(
        later.get(name.rpartition('/')[2], ('no such field',)))) for name, text
        in DEFINITIONS.items()}


def test_a_bag_of_protocol_2_is_read_and_replayed(messages, tmp_path, capsys):
    definitions = definitions_of_protocol_2()
    assert 'all_advice' not in ''.join(definitions.values())
    older = [(topic, msg._replace(protocol=2) if topic == 'world' else msg)
             for topic, msg in messages]
    bag = write_bag(tmp_path / 'bag', older, definitions=definitions)
    assert listed(DecodedMessages(Bag(bag))) == listed(messages)
    assert replay.main(['replay', str(bag)]) == 0
    assert 'matching digest' in capsys.readouterr().out


def test_the_topics_of_mentors_with_names_are_read(tmp_path, capsys):
    written = SimulatedRun(iterations=1, episodes=2, mentors=('anna', 'bob')).messages
    topics = {topic for topic, _ in written}
    assert {'mentors/anna/recommendation', 'mentors/bob/mentor_policy'} <= topics
    bag = write_bag(tmp_path / 'bag', written, namespace='/second')
    assert listed(DecodedMessages(Bag(bag))) == listed(written)
    assert replay.main(['replay', str(bag)]) == 0
    assert 'matching digest' in capsys.readouterr().out


@pytest.mark.parametrize('topic, kind', [
    ('action', 'action'), ('mentors/anna/mentor_policy', 'mentor_policy'),
    ('mentors/anna/action', None), ('mentors/a b/recommendation', None), ('view/map', None),
    ('others/anna/recommendation', None), ('mentors/anna/bob/recommendation', None)])
def test_only_mentors_have_topics_of_their_own(topic, kind):
    assert topic_kind(topic) == kind


def test_a_bag_of_an_unknown_version_is_rejected(messages, tmp_path):
    text = OLD_DEFINITIONS['comply_msgs/msg/WorldDescription'].replace('slips_bump', 'slips')
    strange = {**OLD_DEFINITIONS, 'comply_msgs/msg/WorldDescription': text}
    bag = write_bag(tmp_path / 'bag', messages, definitions=strange)
    with pytest.raises(BagError, match='comply_msgs/msg/WorldDescription must have the fields of '
                       'protocol 3, of protocol 2 or of version 0.1.0; in the bag it has no '
                       'protocol, '):
        list(DecodedMessages(Bag(bag)))


@pytest.mark.parametrize('share', range(0, 100, 4))
def test_a_bag_cut_off_anywhere_is_read_up_to_the_last_whole_message(
        bag, recorded, messages, tmp_path, share):
    source = file_of(bag)
    size = source.stat().st_size * share // 100 + share
    path = tmp_path / source.name
    path.write_bytes(source.read_bytes()[:size])
    truncated = Bag(path)
    read = list(truncated)
    assert read == recorded[:len(read)]
    if len(read) < len(recorded):
        assert source.name in truncated.truncation
    else:
        assert share > 70  # cut off in the index
    assert len(read) >= len(messages) * (share - 30) / 100  # definitions and indices have a part


@pytest.mark.parametrize('share', [20, 40, 60])
def test_messages_before_the_cut_are_verified(bag, messages, tmp_path, share, capsys):
    shutil.copytree(bag, tmp_path / 'bag')
    path = file_of(tmp_path / 'bag')
    path.write_bytes(path.read_bytes()[:path.stat().st_size * share // 100])
    assert replay.main(['replay', str(tmp_path / 'bag')]) == 0
    output = capsys.readouterr()
    assert 'its training had not finished' in output.out
    assert 'was cut off: ' in output.err
    assert 'read up to the last complete message, ' in output.err


@pytest.mark.parametrize('storage', STORAGES)
def test_a_flipped_byte_causes_no_traceback(messages, tmp_path, storage):
    file = file_of(write_bag(tmp_path / 'bag', messages[:60], storage, chunk=50))
    content, path = file.read_bytes(), tmp_path / file.name
    for place in range(0, len(content), len(content) // 12):
        path.write_bytes(content[:place] + bytes([content[place] ^ 0xff]) + content[place + 1:])
        try:
            list(DecodedMessages(Bag(path)))
        except BagError as error:
            assert '\n' not in str(error)


@pytest.mark.parametrize('compression', [CompressionType.ZSTD, CompressionType.LZ4])
def test_compressed_chunks_are_read_and_cut_off_too(messages, tmp_path, compression):
    path, size = tmp_path / 'a.mcap', 0
    with path.open('wb') as file:
        writer, channels = McapWriter(file, chunk_size=5000, compression=compression), {}
        writer.start('ros2')
        for each in Bag(write_bag(tmp_path / 'bag', messages)):
            if each.topic not in channels:
                schema = writer.register_schema(each.message_type, 'ros2msg',
                                                each.definition[1].encode())
                channels[each.topic] = writer.register_channel(each.topic, 'cdr', schema)
            writer.add_message(channels[each.topic], each.time, each.data, each.time)
        writer.finish()
        size = file.tell()
    whole = Bag(path)
    assert listed(DecodedMessages(whole)) == listed(messages) and whole.truncation is None
    path.write_bytes(path.read_bytes()[:size // 2])
    read = list(DecodedMessages(whole))
    assert whole.truncation and listed(read) == listed(messages[:len(read)]) and len(read) > 50


def test_rosbags_reads_a_bag_without_comply_msgs(bag, messages):
    code = (f'import sys; sys.modules["comply_msgs"] = None; from pathlib import Path;'
            f'from rosbags.highlevel import AnyReader\n'
            f'with AnyReader([Path({str(bag)!r})]) as reader:\n'
            f'    found = [reader.deserialize(raw, each.msgtype) '
            f'for each, _, raw in reader.messages()]\n'
            f'    print(len(found), found[0].name)')
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True,
                          check=False)
    assert done.stdout == f'{len(messages)} bar_grid\n', done.stderr
    with AnyReader([bag]) as reader:
        assert reader.topics['/action'].msgtype == 'comply_msgs/msg/Action'


def test_the_mcap_library_reads_an_mcap_bag(messages, tmp_path):
    path = file_of(write_bag(tmp_path / 'bag', messages))
    with path.open('rb') as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        found = [(channel.topic, message)
                 for _, channel, _, message in reader.iter_decoded_messages()]
    assert len(found) == len(messages)
    actions = [message for topic, message in found if topic == '/action']
    written = [each for topic, each in messages if topic == 'action']
    assert [(each.step, each.action, each.confidence) for each in actions] == [
        (each.step, each.action, each.confidence) for each in written]


def invalid_bag(folder, name):
    """Return the path of something that is not a bag with a world."""
    path = folder / name
    if name == 'empty':
        path.mkdir()
    elif name == 'no_messages':
        write_bag(path, [])
    elif name == 'compressed':
        path.mkdir()
        (path / 'a.mcap.zstd').write_bytes(b'1')
    elif name != 'missing':
        path.write_bytes(b'' if name.startswith('no_bytes') else b'it is a text, and no bag')
    return path


@pytest.mark.parametrize('name, message', [
    ('missing', "there is no bag '{0}'"),
    ('empty', "a bag must have files that end in .mcap or .db3, and '{0}' has none"),
    ('compressed', "a bag must have files that end in .mcap or .db3, and '{0}' has compressed "
     'ones: unzstd them first'),
    ('a.txt', "a bag must be a folder, or a file that ends in .mcap or .db3, got '{0}'"),
    ('a.mcap', 'a.mcap: an MCAP file must begin with its magic bytes, got '
     "b'it is a '"),
    ('a.db3', "a.db3: an sqlite3 file must begin with b'SQLite format 3\\x00', got "
     "b'it is a text, an'"),
    ('no_bytes.mcap', "bag '{0}' must have a world, and has none among its 0 messages "
     '(no_bytes.mcap is empty)'),
    ('no_messages', "bag '{0}' must have a world, and has none among its 0 messages")])
@pytest.mark.parametrize('command', ['replay', 'plot'])
def test_an_invalid_bag_is_reported_in_one_line(tmp_path, capsys, command, name, message):
    from comply_ros.bags import plot
    path = invalid_bag(tmp_path, name)
    assert {'replay': replay, 'plot': plot}[command].main([command, str(path)]) == 2
    assert capsys.readouterr().err == f'{command}: {message.format(path)}\n'
