# SPDX-License-Identifier: Apache-2.0
"""The metadata.yaml of a bag, as versions of rosbag2 and other programs write it."""

from bag_fixtures import SimulatedRun, write_bag
import pytest
import yaml

from comply_ros.bags.bag_message import BagError
from comply_ros.bags.bag_reader import Bag, METADATA, TABLE


@pytest.fixture(scope='module')
def written(tmp_path_factory):
    """Return the path of a bag, the text of its metadata, and its messages."""
    path = write_bag(tmp_path_factory.mktemp('bags') / 'bag',
                     SimulatedRun(iterations=1, episodes=2).messages)
    return path, (path / METADATA).read_text(), list(Bag(path))


@pytest.fixture
def with_metadata(written):
    """Return a function that gives the bag with another text or table of metadata."""
    path, text, _ = written

    def change(content=None, **changes):
        table = {**yaml.safe_load(text)[TABLE], **changes}
        table = {key: value for key, value in table.items() if value is not ...}
        (path / METADATA).write_bytes(
            yaml.safe_dump({TABLE: table}).encode() if content is None else content)
        return path
    yield change
    (path / METADATA).write_text(text)


@pytest.mark.parametrize('changes', [
    {'version': 1, 'compression_mode': ..., 'compression_format': ..., 'files': ...,
     'custom_data': ..., 'ros_distro': ...},  # Dashing
    {'version': 4, 'files': ..., 'relative_file_paths': ['bag/bag.mcap']},  # Foxy, with a folder
    {'version': 5, 'custom_data': ...}, {'version': 9, 'custom_data': {'a': 'b'}},
    {'version': 99, 'new_key': [1, {'a': None}]}, {'compression_mode': None},
    {'relative_file_paths': None}, {'relative_file_paths': ['C:\\bags\\bag.mcap']},
    {'compression_mode': 'NONE'}, {'message_count': None}], ids=str)
def test_metadata_of_other_versions_are_read(written, with_metadata, changes):
    bag = Bag(with_metadata(**changes))
    assert list(bag) == written[2]
    assert bag.truncation is None


@pytest.mark.parametrize('touch', [
    lambda text: '\ufeff' + text, lambda text: text.replace('\n', '\r\n'),
    lambda text: text.rstrip('\n'), lambda text: text.replace('\n', '  \n')],
    ids=['byte order mark', 'CRLF', 'no last newline', 'trailing blanks'])
def test_metadata_touched_by_other_programs_are_read(written, with_metadata, touch):
    bag = Bag(with_metadata(touch(written[1]).encode()))
    assert list(bag) == written[2]
    assert bag.expected_count == len(written[2])


@pytest.mark.parametrize('content, reason', [
    (b'', f'it has no table {TABLE}'), (b'a: 1', f'it has no table {TABLE}'),
    (b'- 1', f'it has no table {TABLE}'), (f'{TABLE}: 5'.encode(), f'it has no table {TABLE}'),
    (b'a: [1,', 'it is no YAML after line 1'), (b'\xff\xfe', 'it is not text'),
    (f'{TABLE}: {{message_count: many}}'.encode(), "got 'many' as message_count"),
    (f'{TABLE}: {{message_count: -1}}'.encode(), 'got -1 as message_count'),
    (f'{TABLE}: {{relative_file_paths: [1]}}'.encode(), 'got 1 as relative_file_paths'),
    (f'{TABLE}: {{compression_mode: [a]}}'.encode(), "got ['a'] as compression_mode")])
def test_other_metadata_are_rejected_in_a_sentence(with_metadata, content, reason):
    path = with_metadata(content)
    with pytest.raises(BagError) as caught:
        Bag(path)
    assert str(caught.value) == (
        f'the metadata.yaml of a bag must be as rosbag2 writes it, and that of {str(path)!r} is '
        f'not ({reason}): without the file, all of its messages are read')


def test_messages_that_are_compressed_one_by_one_are_rejected(with_metadata):
    path = with_metadata(compression_mode='MESSAGE')
    with pytest.raises(BagError, match='must not be compressed message by message'):
        Bag(path)
