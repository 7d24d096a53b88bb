# SPDX-License-Identifier: Apache-2.0
"""A lock file in a folder: one process at a time uses the state of a node of that name."""

import fcntl
import os
from pathlib import Path

from comply_ros.storage.file_system import is_same_file


class NameTakenError(OSError):
    """Another process holds the name."""


class NameLock:
    """
    Holds `NAME.lock` in a folder until it is closed; the folder is made where it is missing.

    Raises
    ------
    NameTakenError: if another process holds it.
    OSError: if the folder cannot be written.

    """

    def __init__(self, folder: Path, name: str) -> None:
        self._name, self._path = name, folder / f'{name}.lock'
        self._file: int | None = self._lock()

    def renew(self) -> None:
        """Make folder and lock again if they were removed; raises as the constructor."""
        before = self._file
        if before is not None and not is_same_file(self._path, before):
            self._file = self._lock()
            os.close(before)

    def close(self) -> None:
        """Give the name free."""
        file, self._file = self._file, None
        if file is not None:
            os.close(file)

    def _lock(self) -> int:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(file)
            if isinstance(error, BlockingIOError):
                raise NameTakenError(error.errno, f'another {self._name} uses it') from None
            raise
        return file
