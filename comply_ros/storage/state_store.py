# SPDX-License-Identifier: Apache-2.0
"""What a node has been told, kept on disk: a snapshot, and a journal of what came since."""

import errno
import json
import os
from pathlib import Path
from threading import Event, Lock, Thread
import time

from comply_ros import __version__
from comply_ros.numerics.jit import source_hash
from comply_ros.storage.checkpoint import pack_snapshot, SnapshotError, unpack_snapshot
from comply_ros.storage.file_system import (
    in_line,
    is_at,
    may_exist,
    open_behind,
    write_names_through,
    write_through,
)
from comply_ros.storage.journal import DamagedError, JournalCodec
from comply_ros.storage.name_lock import NameLock, TakenError
from comply_ros.storage.run_files import aside

EVERY = 50_000  # records after which a new snapshot takes the place of the journal
SYNC = 5.0  # seconds between two times that the disk is told to take what was written
LOSSES = (errno.EIO, errno.ENOSPC, errno.EDQUOT)  # of a sync; others mean that there is none
HEX = '[0-9a-f]' * 16  # of a digest, in the name of a journal


class StateError(ValueError):
    """A state that cannot be gone on from; the message names the file, the rule and the value."""


class StateStore:
    """
    Keeps the state of one node in a folder.

    `NAME.snapshot` is written aside, synced to disk and then renamed. `NAME.DIGEST.journal` holds
    what was told since the snapshot with that digest: appended before each answer is said, and
    synced to disk every five seconds.

    Parameters
    ----------
    folder: where.
    name: of the node.
    identity: table of what must be the same for the state to be gone on from.
    kinds: the NamedTuples of numbers that the node can be told.

    Attributes
    ----------
    written: when the last snapshot was written, in seconds since 1970; None before.
    size: bytes in the journal.
    trouble: the OSError with which the disk lost what was written since the snapshot, or None.

    Raises
    ------
    StateError: if the folder cannot be used, or another node uses this name in it.

    """

    def __init__(self, folder, name, identity, kinds):
        self._name, self._kinds = name, kinds
        self._identity = json.loads(json.dumps(
            {'version': f'{__version__} ({source_hash()[:8]})', **identity}))
        self._folder, self._lock = _locked(folder, name)
        self._snapshot = self._folder / f'{name}.snapshot'
        self._path, self._file, self._records = None, None, None
        self._unwritten, self._count = b'', 0
        self.written, self.size, self.trouble = None, 0, None
        self._ended, self._closing = Event(), Lock()
        Thread(target=self._sync, daemon=True).start()

    def recall(self):
        """
        Return (facts, arrays, told) that were kept, None where nothing was.

        Raises
        ------
        StateError: if it cannot be read, is damaged, or is not of this node as it is set now.

        """
        content = _read(self._snapshot)
        if content is None:
            return None
        try:
            digest, facts, arrays = unpack_snapshot(content)
        except SnapshotError as error:
            raise StateError(f'{in_line(self._snapshot)} {error}: move it away to begin '
                             'anew') from None
        self._check(facts.pop('identity'))
        self.written = self._snapshot.stat().st_mtime
        return facts, arrays, self._recall_journal(digest)

    def begin(self, facts, arrays):
        """
        Write a snapshot and begin an empty journal, in a new folder where the old one is gone.

        Raises
        ------
        OSError: if that cannot be; what was kept stays.

        """
        self._lock.hold_again()
        digest, content = pack_snapshot({**facts, 'identity': self._identity}, arrays)
        path = self._journal_of(digest)
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        try:
            with aside(self._snapshot) as part:
                write_through(part, content)
        except BaseException:
            os.close(file)
            raise
        self.written, self._unwritten, self._count, self.trouble = time.time(), b'', 0, None
        self._use(path, file, JournalCodec(self._kinds, digest.encode()), 0)

    def keep(self, told):
        """
        Append to the journal.

        Raises
        ------
        OSError: if it cannot, and the next call first writes what is left; or if the disk has
            lost what was written before, and then only a new snapshot helps.

        """
        if self.trouble:
            raise self.trouble
        for msg in told:
            self._unwritten += self._records.pack(msg)
        self._count += len(told)
        while self._unwritten:
            count = os.write(self._file, self._unwritten)
            self._unwritten = self._unwritten[count:]
            self.size += count

    def is_due(self):
        """Tell whether the journal is long enough for a new snapshot."""
        return self._count >= EVERY

    def put_off(self):
        """Wait for another tenth of a journal before a snapshot is due again."""
        self._count -= EVERY // 10

    def is_lost(self):
        """Tell whether somebody took away what is kept, or put something in its place."""
        return self._file is not None and not (
            is_at(self._path, self._file) and may_exist(self._snapshot))

    def close(self):
        """Sync and close the files; the state can be gone on from elsewhere."""
        self._ended.set()
        self._sync_once()
        with self._closing:
            file, self._file = self._file, None
        if file is not None:
            os.close(file)
        self._lock.close()

    def _recall_journal(self, digest):
        """Return what is in the journal of a snapshot; open it behind the last whole record."""
        path, records = self._journal_of(digest), JournalCodec(self._kinds, digest.encode())
        try:
            told, end = records.unpack(_read(path) or b'')
            self._use(path, open_behind(path, end), records, end)
        except DamagedError as error:
            raise StateError(f'{in_line(path)} must be a journal as it was written, and is '
                             f'damaged: {error}: move {self._name}.* away to begin anew') from None
        except OSError as error:
            raise StateError(f'{in_line(path)} must be a journal that can be written '
                             f'({error.strerror.lower()})') from None
        self._count = len(told)
        return told

    def _use(self, path, file, records, size):
        """Append to this journal from now on, and delete what was there before; raises OSError."""
        with self._closing:
            before, self._file = self._file, file
        self._path, self._records, self.size = path, records, size
        if before is not None:
            os.close(before)
        self._sync_names()
        for other in (*self._folder.glob(f'{self._name}.{HEX}.journal'),
                      *self._folder.glob(f'{self._name}.snapshot.*.part')):  # left by a kill
            if other != path:
                other.unlink(missing_ok=True)

    def _journal_of(self, digest):
        return self._folder / f'{self._name}.{digest[:16]}.journal'

    def _check(self, before):
        """Return if a state was kept by a node like this one."""
        for name in (*self._identity, *before):
            here, there = self._identity.get(name), before.get(name)
            if here != there:
                raise StateError(f'{in_line(self._snapshot)} was kept with {name} '
                                 f'{_short(there)}, and here it is {_short(here)}: give another '
                                 'state_dir, or move it away to begin anew')

    def _sync(self):
        while not self._ended.wait(SYNC):
            self._sync_once()

    def _sync_once(self):
        """Have the disk take what was written."""
        with self._closing:
            if self._file is not None:
                self._note_losses(lambda: os.fdatasync(self._file))

    def _note_losses(self, sync):
        """Call a sync and remember what it says to be lost; there are file systems without one."""
        try:
            sync()
        except OSError as error:
            if error.errno in LOSSES:
                self.trouble = error

    def _sync_names(self):
        """Have the disk take the new names, before the old ones go, where the file system can."""
        self._note_losses(lambda: write_names_through(self._folder))


def _locked(folder, name):
    """
    Return the `Path` of a folder, and the lock of a name in it.

    Raises
    ------
    StateError: if it cannot be used, or another node uses this name in it.

    """
    try:
        path = Path(folder).expanduser()
        return path, NameLock(path, name)
    except TakenError:
        raise StateError(f'state_dir {str(folder)!r} is used by another {name} that runs: end it, '
                         'or give this one another state_dir') from None
    except OSError as error:
        reason = error.strerror.lower()
    except RuntimeError:  # ~USER/
        reason = 'no such user'
    except ValueError:  # a NUL, or half of a character
        reason = 'no folder can have this name'
    raise StateError(f'state_dir must be a folder that can be written, got {str(folder)!r} '
                     f'({reason})')


def _read(path):
    """
    Return the bytes of a file, None where there is none.

    Raises
    ------
    StateError: if it cannot be read.

    """
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise StateError(f'{in_line(path)} must be a file that can be read '
                         f'({error.strerror.lower()})') from None


def _short(value):
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + '...'
