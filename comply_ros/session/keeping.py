# SPDX-License-Identifier: Apache-2.0
"""What a node has been told, kept on disk: a snapshot, and a journal of what came since."""

import fcntl
import json
import os
from pathlib import Path
from threading import Event, Lock, Thread
import time

from comply_ros import __version__
from comply_ros.core.compiled import fingerprint
from comply_ros.session.records import DamagedError, Records
from comply_ros.session.results import aside
from comply_ros.session.snapshots import pack_snapshot, SnapshotError, unpack_snapshot

EVERY = 50_000  # records after which a new snapshot takes the place of the journal
SYNC = 1.0  # seconds between two times that the disk is told to take what was written


class StateError(ValueError):
    """A state that cannot be gone on from; the message names the file, the rule and the value."""


class Keeper:
    """
    Keeps the state of one node in a folder.

    `NAME.snapshot` is written aside, synced to disk and then renamed. `NAME.DIGEST.journal` holds
    what was told since the snapshot with that digest: appended before each answer is said, and
    synced to disk once a second.

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
    trouble: the OSError of the last sync, None after one that went well.

    Raises
    ------
    StateError: if the folder cannot be used, or another node uses this name in it.

    """

    def __init__(self, folder, name, identity, kinds):
        self._folder, self._name, self._kinds = Path(folder).expanduser(), name, kinds
        self._identity = json.loads(json.dumps(
            {'version': f'{__version__} ({fingerprint()[:8]})', **identity}))
        self._path, self._file, self._records = None, None, None
        self._unwritten, self._count = b'', 0
        self.written, self.size, self.trouble = None, 0, None
        self._lock = self._locked()
        self._ended, self._closing = Event(), Lock()
        Thread(target=self._sync, daemon=True).start()

    def recall(self):
        """
        Return (facts, arrays, told) that were kept, None where nothing was.

        Raises
        ------
        StateError: if it cannot be read, is damaged, or is not of this node as it is set now.

        """
        path = self._folder / f'{self._name}.snapshot'
        content = _read(path)
        if content is None:
            return None
        try:
            digest, facts, arrays = unpack_snapshot(content)
        except SnapshotError as error:
            raise StateError(f'{path} {error}: move it away to begin anew') from None
        self._check(path, facts.pop('identity'))
        self.written = path.stat().st_mtime
        return facts, arrays, self._recall_journal(digest)

    def begin(self, facts, arrays):
        """Write a snapshot and begin an empty journal; raises OSError, and what was kept stays."""
        self._folder.mkdir(parents=True, exist_ok=True)
        digest, content = pack_snapshot({**facts, 'identity': self._identity}, arrays)
        with aside(self._folder / f'{self._name}.snapshot') as part:
            with part.open('wb') as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            path = self._journal_of(digest)
            file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        self._use(path, file, Records(self._kinds, digest.encode()), 0)
        self.written, self._unwritten, self._count = time.time(), b'', 0

    def keep(self, told):
        """Append to the journal; raises OSError, and what could not be written is tried again."""
        pack = self._records.pack
        self._unwritten += b''.join([pack(said) for said in told])
        self._count += len(told)
        self.flush()

    def flush(self):
        """Write what could not be written before; raises OSError."""
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
        """Tell whether somebody has taken the journal away."""
        return self._path is not None and not self._path.exists()

    def close(self):
        """Sync and close the files; the state can be gone on from elsewhere."""
        self._ended.set()
        if self._file is not None:
            self._sync_once()
            with self._closing:
                os.close(self._file)
                self._file = None
        os.close(self._lock)

    def _recall_journal(self, digest):
        """Return what is in the journal of a snapshot; open it behind the last whole record."""
        path, records = self._journal_of(digest), Records(self._kinds, digest.encode())
        try:
            told, end = records.unpack(_read(path) or b'')
            file = os.open(path, os.O_WRONLY | os.O_CREAT, 0o666)
            os.ftruncate(file, end)
            os.lseek(file, end, os.SEEK_SET)
        except DamagedError as error:
            raise StateError(f'{path} must be a journal as it was written, and is damaged: '
                             f'{error}') from None
        except OSError as error:
            raise StateError(f'{path} must be a journal that can be written '
                             f'({error.strerror.lower()})') from None
        self._use(path, file, records, end)
        self._count = len(told)
        return told

    def _use(self, path, file, records, size):
        """Append to this journal from now on, and delete all others."""
        before = self._file
        with self._closing:
            self._path, self._file, self._records, self.size = path, file, records, size
        if before is not None:
            os.close(before)
        for other in self._folder.glob(f'{self._name}.*.journal'):
            if other != path:
                other.unlink(missing_ok=True)

    def _journal_of(self, digest):
        return self._folder / f'{self._name}.{digest[:16]}.journal'

    def _check(self, path, before):
        for name, value in self._identity.items():
            if before.get(name) != value:
                raise StateError(f'{path} was kept with {name} {_short(before.get(name))}, and '
                                 f'here it is {_short(value)}: give another state_dir, or move it '
                                 'away to begin anew')

    def _locked(self):
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            lock = os.open(self._folder / f'{self._name}.lock', os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise StateError('state_dir must be a folder that can be written, got '
                             f'{str(self._folder)!r} ({error.strerror.lower()})') from None
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            raise StateError(f'state_dir {str(self._folder)!r} is used by another {self._name} '
                             'that runs: end it, or give this one another state_dir') from None
        return lock

    def _sync(self):
        while not self._ended.wait(SYNC):
            self._sync_once()

    def _sync_once(self):
        """Have the disk take what was written."""
        with self._closing:
            try:
                if self._file is not None:
                    os.fdatasync(self._file)
                self.trouble = None
            except OSError as error:
                self.trouble = error


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
        raise StateError(f'{path} must be a file that can be read '
                         f'({error.strerror.lower()})') from None


def _short(value):
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + '...'
