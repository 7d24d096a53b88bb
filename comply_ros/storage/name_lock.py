# SPDX-License-Identifier: Apache-2.0
"""A name in a folder that only one process holds at a time."""

import fcntl
import os

from comply_ros.storage.file_system import is_at


class TakenError(OSError):
    """Another process holds the name."""


class NameLock:
    """
    Holds `NAME.lock` in a folder, which is made where it is not there, until it is closed.

    Raises
    ------
    TakenError: if another holds it.
    OSError: if the folder cannot be written.

    """

    def __init__(self, folder, name):
        self._folder, self._name, self._path = folder, name, folder / f'{name}.lock'
        self._file = self._locked()

    def hold_again(self):
        """Make folder and lock anew if somebody took them away; raises as at the beginning."""
        if not is_at(self._path, self._file):
            before, self._file = self._file, self._locked()
            os.close(before)

    def close(self):
        """Let others have it."""
        file, self._file = self._file, None
        if file is not None:
            os.close(file)

    def _locked(self):
        self._folder.mkdir(parents=True, exist_ok=True)
        file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            os.close(file)
            raise TakenError(error.errno, f'another {self._name} uses it') from None
        except OSError:
            os.close(file)
            raise
        return file
