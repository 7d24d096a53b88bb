# SPDX-License-Identifier: Apache-2.0
"""The files that a run names, shipped with it to another machine by their SHA-256."""

from functools import lru_cache
import hashlib
from pathlib import Path
import tempfile
from threading import Lock
from typing import NamedTuple

from comply_ros.experiments.training_runs import reference_returns_of, Run
from comply_ros.mentor.mentor_spec import FROM_FILES, parse_mentor_spec
from comply_ros.mentor.several_mentors import joined, split_mentors
from comply_ros.storage.file_system import atomic_write
from comply_ros.storage.map_name import is_path, NAV2, parse_map_name
from comply_ros.storage.text_and_yaml_files import dump_yaml, load_yaml

NAV2_FILES = 'nav2', 'image'  # keys: a map file can name one of Nav2, and that names its image

_lock = Lock()

MENTOR = 'mentor'  # the field of `Run`; of several, with a colon and the name behind it


class ShippingError(ValueError):
    """A run that would not be the same on another machine; the message names what differs."""


class NamedFile(NamedTuple):
    """
    The path of a file, and by which key of its YAML it can name another one.

    keys: of this file, of the one that it names, and so on.
    """

    path: str
    keys: tuple[str, ...] = ()


class ShippedFile(NamedTuple):
    """
    A file: how its name ends, its content, and the SHA-256 (hex) of all that is in it.

    named: the file that it names by a key of its YAML; None for none.
    """

    suffix: str
    content: bytes
    sha256: str
    key: str = ''
    named: 'ShippedFile | None' = None


def files_of(run: Run) -> dict[str, NamedFile]:
    """Return the files of a run: `map`, `mentor`, or `mentor:NAME` of each of several."""
    files: dict[str, NamedFile] = {}
    scheme, target, _ = parse_map_name(run.map)
    if scheme == NAV2:
        files['map'] = NamedFile(target, NAV2_FILES[1:])
    elif is_path(run.map):
        files['map'] = NamedFile(run.map, NAV2_FILES)
    for name, text in split_mentors(run.mentor).items():
        spec = parse_mentor_spec(text)
        if spec.kind in FROM_FILES:
            files[_mentor_key(name)] = NamedFile(spec.value)
    return files


def _mentor_key(name: str) -> str:
    return f'{MENTOR}:{name}' if name else MENTOR


def read_file(file: NamedFile) -> ShippedFile:
    """Return a file as it is now, with the one that it names; raises OSError."""
    path = Path(file.path).expanduser()
    content = path.read_bytes()
    shipped = ShippedFile(path.suffix, content, hashlib.sha256(content).hexdigest())
    key, *keys = file.keys or ('',)
    if not key or key.encode() not in content:
        return shipped
    name = load_yaml(content.decode('utf-8-sig')).value.get(key)
    if name is None:
        return shipped
    named = read_file(NamedFile(str(path.parent / Path(name).expanduser()), tuple(keys)))
    both = hashlib.sha256(f'{shipped.sha256} {named.sha256}'.encode()).hexdigest()
    return ShippedFile(path.suffix, content, both, key, named)


def world_of(run: Run) -> str:
    """SHA-256 (hex) of the world of a run, as this machine reads it."""
    return reference_returns_of(run).world.sha256


def unpack(run: Run, files: dict[str, ShippedFile], world: str) -> Run:
    """
    Return the run with the paths of shipped files, written to a folder of this process.

    A file is named by its content, so that what is cached by a path is of that content.

    Raises
    ------
    ShippingError: if the world of the run is another one here.

    """
    paths = {field: str(_written(file)) for field, file in files.items()}
    if run.map.startswith(f'{NAV2}:'):
        _, question, arguments = run.map.partition('?')
        paths['map'] = f'{NAV2}:{paths["map"]}{question}{arguments}'
    mentors = split_mentors(run.mentor)
    for name, text in mentors.items():
        if path := paths.pop(_mentor_key(name), None):
            spec = parse_mentor_spec(text)
            share = '' if spec.coverage == 1.0 else f'@{spec.coverage!r}'
            mentors[name] = f'{spec.kind}:{path}{share}'
    paths['mentor'] = joined([f'{name}={text}' if name else text
                              for name, text in mentors.items()])
    unpacked = run._replace(**paths)
    if world_of(unpacked) != world:
        raise ShippingError(f'map {run.map!r} must be the same on all machines, and this one has '
                            'another: install the same version of comply_ros on each')
    return unpacked


@lru_cache(maxsize=1)
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix='comply_ros_')  # deleted at the end of the process


def _written(file: ShippedFile) -> Path:
    content = file.content
    if file.named:
        table = load_yaml(content.decode('utf-8-sig')).value
        content = dump_yaml({**table, file.key: str(_written(file.named))}).encode()
    path = Path(_folder().name) / f'{file.sha256}{file.suffix}'
    with _lock:  # a worker may have threads
        if not path.exists():
            with atomic_write(path) as part:
                part.write_bytes(content)
    return path
