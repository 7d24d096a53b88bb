# SPDX-License-Identifier: Apache-2.0
"""A rosbag2 bag: a folder of MCAP or sqlite3 files, or one such file."""

from collections.abc import Iterator
from pathlib import Path
import re
from typing import Any

import yaml

from comply_ros.bags.bag_message import BagError, BagMessage, TruncatedFile
from comply_ros.bags.mcap_file import read_mcap
from comply_ros.bags.sqlite_file import read_sqlite

READERS = {'.mcap': read_mcap, '.db3': read_sqlite}
METADATA = 'metadata.yaml'


class Bag:
    """
    The messages of a bag, in the order in which they were recorded; BagError without a bag.

    Attributes
    ----------
    path: of its folder, or of its only file.
    files: paths of its files, in order.
    expected_count: number of messages according to its `metadata.yaml`, None without one.
    count: messages read so far.
    truncation: what is missing after those; None if the bag is complete.

    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path).expanduser()
        self.count, self.truncation = 0, None
        if not self.path.exists():
            raise BagError(f'there is no bag {str(path)!r}')
        metadata = _metadata(self.path)
        if metadata.get('compression_mode', '').lower() == 'message':
            raise BagError(f'bag {str(path)!r} must not be compressed message by message: '
                           'decompress it with ros2 bag convert')
        self.files = _files(self.path, metadata)
        self.expected_count = metadata.get('message_count') if self.path.is_dir() else None

    def __iter__(self) -> Iterator[BagMessage]:
        """Yield every message; raises BagError for a file that does not belong to a bag."""
        self.count, self.truncation = 0, None
        for path in self.files:
            try:
                if not path.stat().st_size:
                    raise TruncatedFile('is empty')
                for message in READERS[path.suffix](path):
                    self.count += 1
                    yield message
            except TruncatedFile as error:
                self.truncation = f'{path.name} {error}'
                return
            except BagError as error:
                raise BagError(f'{path.name}: {error}') from None
        if self.path.is_dir():
            if self.expected_count is None and self.files[0].suffix == '.db3':
                self.truncation = f'it has no {METADATA}: its recorder was killed or still runs'
            elif self.expected_count is not None and self.count < self.expected_count:
                self.truncation = f'its {METADATA} announces {self.expected_count} messages'


def _metadata(path: Path) -> dict[str, Any]:
    """Return the metadata of a bag, empty without any: the recorder writes them at its end."""
    try:
        text = (path / METADATA).read_text()
        return dict(yaml.safe_load(text)['rosbag2_bagfile_information'])
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError):
        return {}


def _files(path: Path, metadata: dict[str, Any]) -> list[Path]:
    if path.is_file():
        if path.suffix not in READERS:
            raise BagError('a bag must be a folder, or a file that ends in .mcap or .db3, '
                           f'got {str(path)!r}')
        return [path]
    listed = [path / Path(str(name)).name for name in metadata.get('relative_file_paths') or ()]
    files = [file for file in listed if file.is_file() and file.suffix in READERS]
    if not files:
        files = sorted((file for file in path.iterdir() if file.suffix in READERS),
                       key=lambda file: [int(part) if part.isdigit() else part
                                         for part in re.split(r'(\d+)', file.name)])
    if not files:
        found = 'compressed ones: unzstd them first' if any(path.glob('*.zstd')) else 'none'
        raise BagError(f'a bag must have files that end in .mcap or .db3, and {str(path)!r} has '
                       f'{found}')
    return files
