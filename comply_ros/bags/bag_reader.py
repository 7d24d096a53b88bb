# SPDX-License-Identifier: Apache-2.0
"""A bag as ROS users have it: a folder of MCAP or sqlite3 files, or one such file."""

from pathlib import Path
import re

import yaml

from comply_ros.bags.bag_message import BagError, CutOff
from comply_ros.bags.mcap_file import read_mcap
from comply_ros.bags.sqlite_file import read_sqlite

READERS = {'.mcap': read_mcap, '.db3': read_sqlite}
METADATA = 'metadata.yaml'


class Bag:
    """
    The messages of a bag, in the order in which they were recorded.

    Parameters
    ----------
    path: of its folder, or of one of its files.

    Attributes
    ----------
    path: as given.
    files: its files, in order.
    expected: number of messages that its `metadata.yaml` promises, None without one.
    count: messages that were read so far.
    cut: why it does not go on after those, in words; None where it is whole.

    Raises
    ------
    BagError: if there is no bag.

    """

    def __init__(self, path):
        self.path = Path(path).expanduser()
        self.count, self.cut, self.expected = 0, None, None
        if not self.path.exists():
            raise BagError(f'there is no bag {str(path)!r}')
        facts = _metadata(self.path)
        if facts.get('compression_mode', '').lower() == 'message':
            raise BagError(f'bag {str(path)!r} must not be compressed message by message: '
                           'have ros2 bag convert write it plainly')
        self.files = _files(self.path, facts)
        if self.path.is_dir():
            self.expected = facts.get('message_count')

    def __iter__(self):
        """Yield every `BagMessage` message; raises BagError for a file that is none of a bag."""
        self.count, self.cut = 0, None
        for path in self.files:
            try:
                for each in READERS[path.suffix](path):
                    self.count += 1
                    yield each
            except CutOff as cut:
                self.cut = f'{path.name} {cut}'
                return
            except BagError as error:
                raise BagError(f'{path.name}: {error}') from None
        if self.cut is None and self.path.is_dir():
            self.cut = self._what_is_missing()

    def _what_is_missing(self):
        if self.expected is None and self.files[0].suffix == '.db3':
            return f'it has no {METADATA}, so its recorder was killed or runs still'
        if self.expected is not None and self.count < self.expected:
            return f'its {METADATA} promises {self.expected} messages'
        return None


def _metadata(path):
    """Return the facts of the bag that a path leads to, an empty table where there are none."""
    try:
        text = (path / METADATA).read_text()
        return dict(yaml.safe_load(text)['rosbag2_bagfile_information'])
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError):
        return {}  # written last, by a recorder that was not killed


def _files(path, facts):
    if path.is_file():
        if path.suffix not in READERS:
            raise BagError('a bag must be a folder, or a file that ends in .mcap or .db3, '
                           f'got {str(path)!r}')
        return [path]
    named = [path / Path(str(name)).name for name in facts.get('relative_file_paths') or ()]
    there = [each for each in named if each.is_file() and each.suffix in READERS]
    found = there or sorted((each for each in path.iterdir() if each.suffix in READERS),
                            key=lambda each: [int(part) if part.isdigit() else part
                                              for part in re.split(r'(\d+)', each.name)])
    if not found:
        packed = any(path.glob('*.zstd'))
        raise BagError('a bag must have files that end in .mcap or .db3, and '
                       f'{str(path)!r} has ' + ('compressed ones: unzstd them first' if packed
                                                else 'none'))
    return found
