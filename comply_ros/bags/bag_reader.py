# SPDX-License-Identifier: Apache-2.0
"""A rosbag2 bag: a folder of MCAP or sqlite3 files, or one such file."""

from collections.abc import Iterator
from pathlib import Path
import re

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError

from comply_ros.bags.bag_message import BagError, BagMessage, TruncatedFile
from comply_ros.bags.mcap_file import read_mcap
from comply_ros.bags.sqlite_file import read_sqlite
from comply_ros.storage.file_system import path_errors, PathError
from comply_ros.storage.text_and_yaml_files import shown

READERS = {'.mcap': read_mcap, '.db3': read_sqlite}
METADATA = 'metadata.yaml'
TABLE = 'rosbag2_bagfile_information'


class Metadata(BaseModel):
    """What is used of the table in `metadata.yaml`, which differs from version to version."""

    model_config = ConfigDict(strict=True)
    compression_mode: str = ''
    relative_file_paths: list[str] = []
    message_count: int | None = Field(None, ge=0)


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
        metadata = _metadata(self.path) if self.path.is_dir() else Metadata()
        if metadata.compression_mode.lower() == 'message':
            raise BagError(f'bag {str(path)!r} must not be compressed message by message: '
                           'decompress it with ros2 bag convert')
        self.files = _files(self.path, metadata.relative_file_paths)
        self.expected_count = metadata.message_count

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


def _metadata(path: Path) -> Metadata:
    """
    Metadata of a bag, empty without a file of them: the recorder writes it at its end.

    Raises
    ------
    BagError: for a file with anything else in it.

    """
    try:
        with path_errors():
            text = (path / METADATA).read_text(encoding='utf-8-sig') if (
                path / METADATA).exists() else f'{TABLE}: {{}}'
        table = YAML(typ='safe', pure=True).load(text)[TABLE]
        return Metadata.model_validate({
            key: value for key, value in table.items() if value is not None})
    except PathError as error:
        reason = str(error)
    except ValidationError as error:
        wrong = error.errors()[0]
        reason = f'got {shown(wrong["input"])} as {wrong["loc"][0]}'
    except MarkedYAMLError as error:
        reason = f'it is no YAML after line {error.problem_mark.line + 1}'
    except Exception:  # noqa: BLE001 - an arbitrary text can raise anything
        reason = f'it has no table {TABLE}'
    raise BagError(f'the {METADATA} of a bag must be as rosbag2 writes it, and that of '
                   f'{str(path)!r} is not ({reason}): without the file, all of its messages '
                   'are read')


def _files(path: Path, names: list[str]) -> list[Path]:
    if path.is_file():
        if path.suffix not in READERS:
            raise BagError('a bag must be a folder, or a file that ends in .mcap or .db3, '
                           f'got {str(path)!r}')
        return [path]
    listed = [path / Path(name.replace('\\', '/')).name for name in names]
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
