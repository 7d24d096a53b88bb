# SPDX-License-Identifier: Apache-2.0
"""The files that a run names, shipped with it to another machine by their SHA-256."""

from functools import lru_cache
import hashlib
from pathlib import Path
import tempfile
from threading import Lock
from typing import NamedTuple

from comply_ros.experiments.training_runs import reference_returns_of, Run
from comply_ros.mentor.mentor_policies import FROM_FILES, parse_mentor_spec
from comply_ros.storage.file_system import atomic_write
from comply_ros.storage.map_name import is_path

_lock = Lock()


class ShippingError(ValueError):
    """A run that would not be the same on another machine; the message names what differs."""


class ShippedFile(NamedTuple):
    """A file: how its name ends, its content, and the SHA-256 (hex) of that."""

    suffix: str
    content: bytes
    sha256: str


def files_of(run: Run) -> dict[str, str]:
    """Return the paths of the files of a run, by the field of `Run` that names them."""
    files = {'map': run.map} if is_path(run.map) else {}
    spec = parse_mentor_spec(run.mentor)
    return {**files, 'mentor': spec.value} if spec.kind in FROM_FILES else files


def read_file(path: str) -> ShippedFile:
    """Return a file as it is now; raises OSError."""
    place = Path(path).expanduser()
    content = place.read_bytes()
    return ShippedFile(place.suffix, content, hashlib.sha256(content).hexdigest())


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
    if 'mentor' in paths:
        spec = parse_mentor_spec(run.mentor)
        share = '' if spec.coverage == 1.0 else f'@{spec.coverage!r}'
        paths['mentor'] = f'{spec.kind}:{paths["mentor"]}{share}'
    unpacked = run._replace(**paths)
    if world_of(unpacked) != world:
        raise ShippingError(f'map {run.map!r} must be the same on all machines, and this one has '
                            'another: install the same version of comply_ros on each')
    return unpacked


@lru_cache(maxsize=1)
def _folder() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix='comply_ros_')  # deleted at the end of the process


def _written(file: ShippedFile) -> Path:
    path = Path(_folder().name) / f'{file.sha256}{file.suffix}'
    with _lock:  # a worker may have threads
        if not path.exists():
            with atomic_write(path) as part:
                part.write_bytes(file.content)
    return path
