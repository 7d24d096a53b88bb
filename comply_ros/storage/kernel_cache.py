# SPDX-License-Identifier: Apache-2.0
"""Compiled code, kept in a folder of the user's cache from one process to the next."""

import hashlib
import os
from pathlib import Path
import shutil

from comply_ros.numerics.jit import use_cache

PACKAGE = Path(__file__).parents[1]
ROOMS = ('numerics', 'world', 'mentor', 'learner')  # those with functions that are compiled
FOLDERS_KEPT = 5  # of compiled code: of these sources, and of those that were used last


def cache_folder() -> Path:
    """Folder of what is slow to make: `$XDG_CACHE_HOME/comply_ros`, by default in `~/.cache`."""
    return Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache') / 'comply_ros'


def use_kernel_cache() -> None:
    """Keep what this process compiles from now on, and use what others have compiled."""
    use_cache(KernelCache())


class KernelCache:
    """
    A folder for the compiled code of exactly these sources: `kernels/HASH` in the cache.

    numba notices a change of the compiled function, not of the functions that it calls. With a
    folder for each state of the sources, old machine code never runs.
    """

    def folder(self) -> str | None:
        """Return the folder, made where it is missing; None where it cannot be written."""
        try:
            folder = self._path()
            folder.mkdir(parents=True, exist_ok=True)
            os.utime(folder)  # it is in use
        except (OSError, RuntimeError):  # RuntimeError: this user has no home
            return None
        _delete_old_folders(folder.parent)
        return str(folder) if os.access(folder, os.W_OK) else None

    def clear(self) -> None:
        """Delete the folder."""
        shutil.rmtree(self._path(), ignore_errors=True)

    def _path(self) -> Path:
        return cache_folder() / 'kernels' / kernel_hash()[:16]


def kernel_hash() -> str:
    """SHA-256 (hex) of the names and the content of all sources that can be compiled."""
    digest = hashlib.sha256()
    for room in ROOMS:
        for source in sorted((PACKAGE / room).glob('*.py')):
            digest.update(f'{room}/{source.name}\0'.encode() + source.read_bytes())
    return digest.hexdigest()


def _delete_old_folders(kernels: Path) -> None:
    """Delete all but those folders of compiled code that were used last."""
    try:
        folders = sorted(kernels.iterdir(), key=lambda each: each.stat().st_mtime)
    except OSError:  # another process deletes them too
        return
    for folder in folders[:-FOLDERS_KEPT]:
        shutil.rmtree(folder, ignore_errors=True)
