# SPDX-License-Identifier: Apache-2.0
"""The state of a node on disk: a checkpoint, and a journal of the messages that came since."""

from collections.abc import Mapping, Sequence
import errno
import json
import os
from pathlib import Path
from threading import Event, Lock, Thread
import time
from typing import Any

from comply_ros.storage.checkpoint_bytes import (
    CheckpointError,
    pack_checkpoint,
    unpack_checkpoint,
    version_problem,
)
from comply_ros.storage.file_system import (
    atomic_write,
    is_same_file,
    may_exist,
    open_truncated,
    path_errors,
    PathError,
    printable,
    reason_of,
    sync_folder,
    write_synced,
)
from comply_ros.storage.message_journal import DamagedError, JournalCodec
from comply_ros.storage.state_dir_lock import NameLock, NameTakenError
from comply_ros.storage.text_and_yaml_files import shown
from comply_ros.storage.versions import FORMAT_VERSION

RECORDS_PER_CHECKPOINT = 50_000  # after so many, a new checkpoint takes the place of the journal
SYNC_PERIOD = 5.0  # seconds between two syncs of the journal to the disk
LOSSES = (errno.EIO, errno.ENOSPC, errno.EDQUOT)  # of a sync; others mean that there is none
DIGEST_LENGTH = 12  # hex digits in the name of a journal; version 0.1.0 deletes those of 16


class StateError(ValueError):
    """A state that cannot be continued; the message names the file, the rule and the value."""


def lock_state_dir(folder: str | Path, name: str) -> tuple[Path, NameLock]:
    """
    Return the path of a `state_dir`, which is made, and the lock of a name in it.

    Raises
    ------
    StateError: if the folder cannot be used, or another node uses this name in it.

    """
    try:
        with path_errors():
            path = Path(folder).expanduser()
            return path, NameLock(path, name)
    except PathError as error:
        if isinstance(error.__cause__, NameTakenError):
            raise StateError(f'state_dir {str(folder)!r} is in use by another running {name}: '
                             'stop that one, or give this one another state_dir') from None
        raise StateError('state_dir must be a folder that can be written, got '
                         f'{str(folder)!r} ({error})') from None


class CheckpointStore:
    """
    Keeps the state of one node in a folder, so that it can go on after a kill.

    `NAME.checkpoint` holds the whole state; it is replaced as a whole and synced to the disk.
    `NAME.DIGEST.journal` holds the messages since the checkpoint with that digest. A node appends
    a message before it publishes what follows from it; a sync follows within five seconds.

    Parameters
    ----------
    folder: where the files are.
    name: of the node.
    identity: table of what must be the same for a node to continue the state.
    kinds: the NamedTuples of numbers that the journal can hold.
    added: what older checkpoints do not have in their identity, and the value that it had then.

    Attributes
    ----------
    checkpoint_time: when the last checkpoint was written, in seconds since 1970; None before.
    journal_bytes: size of the journal.
    sync_error: the OSError with which the disk lost what was written since the checkpoint, or
        None.

    Raises
    ------
    StateError: if the folder cannot be used, or another node uses this name in it.

    """

    def __init__(self, folder: str | Path, name: str, identity: Mapping[str, Any],
                 kinds: Sequence[type[Any]], added: Mapping[str, Any] | None = None) -> None:
        self._name, self._kinds, self._added = name, kinds, added or {}
        self._identity = json.loads(json.dumps(identity))
        self._folder, self._lock = lock_state_dir(folder, name)
        self._checkpoint = self._folder / f'{name}.checkpoint'
        self._journal, self._codec = Path(), JournalCodec(kinds, b'')
        self._file = -1  # descriptor of the journal; -1 while none is open
        self._unwritten, self._count = b'', 0
        self.checkpoint_time: float | None = None
        self.sync_error: OSError | None = None
        self.journal_bytes = 0
        self._closed, self._file_lock = Event(), Lock()
        Thread(target=self._sync_regularly, daemon=True).start()

    def load(self) -> tuple[dict[str, Any], dict[str, Any], list[Any]] | None:
        """
        Return facts and arrays of the checkpoint, and the journal's entries; None without one.

        Raises
        ------
        StateError: if the files cannot be read, are damaged, or belong to another node or version.

        """
        old = self._folder / f'{self._name}.snapshot'  # of format 1
        if os.path.exists(old):
            raise self._error(old, version_problem('format', 1, FORMAT_VERSION))
        content = _read(self._checkpoint)
        if content is None:
            return None
        try:
            digest, facts, arrays = unpack_checkpoint(content)
        except CheckpointError as error:
            raise self._error(self._checkpoint, str(error)) from None
        identity = {**self._added, **facts.pop('identity')}
        for name in (*self._identity, *identity):
            here, there = self._identity.get(name), identity.get(name)
            if here != there:
                raise self._error(self._checkpoint, f'was written with {name} {shown(there, 80)}, '
                                  f'but this node has {shown(here, 80)}')
        self.checkpoint_time = self._checkpoint.stat().st_mtime
        return facts, arrays, self._load_journal(digest)

    def write_checkpoint(self, facts: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
        """
        Replace checkpoint and journal by this state and an empty journal.

        Where the folder was removed, it is made again.

        Raises
        ------
        OSError: if that cannot be; the files are as before.

        """
        self._lock.renew()
        digest, content = pack_checkpoint({**facts, 'identity': self._identity}, arrays)
        path = self._journal_path(digest)
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        try:
            with atomic_write(self._checkpoint) as part:
                write_synced(part, content)
        except BaseException:
            os.close(file)
            raise
        self.checkpoint_time, self.sync_error = time.time(), None
        self._unwritten, self._count = b'', 0
        self._use_journal(path, file, JournalCodec(self._kinds, digest.encode()), 0)

    def append(self, entries: Sequence[Any]) -> None:
        """
        Append messages to the journal.

        Raises
        ------
        OSError: if they cannot be written, and the next call first writes the rest of them; or if
            the disk has lost what was written before, and only a new checkpoint helps.

        """
        if self.sync_error:
            raise self.sync_error
        for entry in entries:
            self._unwritten += self._codec.pack(entry)
        self._count += len(entries)
        while self._unwritten:
            count = os.write(self._file, self._unwritten)
            self._unwritten = self._unwritten[count:]
            self.journal_bytes += count

    def is_checkpoint_due(self) -> bool:
        """Whether the journal is long enough for a new checkpoint."""
        return self._count >= RECORDS_PER_CHECKPOINT

    def postpone_checkpoint(self) -> None:
        """Let a tenth of a journal pass before a checkpoint is due again."""
        self._count -= RECORDS_PER_CHECKPOINT // 10

    def was_removed(self) -> bool:
        """Whether checkpoint or journal were removed or replaced by somebody else."""
        return self._file >= 0 and not (
            is_same_file(self._journal, self._file) and may_exist(self._checkpoint))

    def sync(self) -> None:
        """Sync the journal to the disk; an error that means a loss is in `sync_error`."""
        with self._file_lock:
            if self._file >= 0:
                self._try_sync(lambda: os.fdatasync(self._file))

    def close(self) -> None:
        """Sync and close the files; another store can continue the state."""
        self._closed.set()
        self.sync()
        with self._file_lock:
            file, self._file = self._file, -1
        if file >= 0:
            os.close(file)
        self._lock.close()

    def _load_journal(self, digest: str) -> list[Any]:
        """Return the entries of a checkpoint's journal; open it after the last whole record."""
        path, codec = self._journal_path(digest), JournalCodec(self._kinds, digest.encode())
        try:
            entries, end = codec.unpack(_read(path) or b'')
            self._use_journal(path, open_truncated(path, end), codec, end)
        except DamagedError as error:
            raise self._error(path, f'must be as it was written, but {error}') from None
        except OSError as error:
            raise StateError(f'{printable(path)} must be a journal that can be written '
                             f'({reason_of(error)})') from None
        self._count = len(entries)
        return entries

    def _use_journal(self, path: Path, file: int, codec: JournalCodec, size: int) -> None:
        """Append to this journal from now on, and delete older files; raises OSError."""
        with self._file_lock:
            before, self._file = self._file, file
        self._journal, self._codec, self.journal_bytes = path, codec, size
        if before >= 0:
            os.close(before)
        self._try_sync(lambda: sync_folder(self._folder))  # new names, before the old ones go
        for other in (*self._folder.glob(f'{self._name}.{"[0-9a-f]" * DIGEST_LENGTH}.journal'),
                      *self._folder.glob(f'{self._name}.checkpoint.*.part')):  # left by a kill
            if other != path:
                other.unlink(missing_ok=True)

    def _journal_path(self, digest: str) -> Path:
        return self._folder / f'{self._name}.{digest[:DIGEST_LENGTH]}.journal'

    def _error(self, path: Path, problem: str) -> StateError:
        return StateError(f'{printable(path)} {problem}: give another state_dir, or move '
                          f'{self._name}.* away to start anew')

    def _sync_regularly(self) -> None:
        while not self._closed.wait(SYNC_PERIOD):
            self.sync()

    def _try_sync(self, sync: Any) -> None:
        """Call a sync and remember a loss that it reports; some file systems have none."""
        try:
            sync()
        except OSError as error:
            if error.errno in LOSSES:
                self.sync_error = error


def _read(path: Path) -> bytes | None:
    """Return the bytes of a file, None where there is none; raises StateError."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise StateError(f'{printable(path)} must be a file that can be read '
                         f'({reason_of(error)})') from None
