# SPDX-License-Identifier: Apache-2.0
"""What was stored can be loaded, whatever happens to the process, the disk or the files."""

from contextlib import closing
import errno
from itertools import count
import os
from pathlib import Path
import random
import shutil
import threading
from typing import NamedTuple

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from comply_ros.storage import checkpoint_bytes, checkpoint_store, versions
from comply_ros.storage.checkpoint_store import CheckpointStore, StateError
from examples import examples

fuzz = examples(100)
IDENTITY = {'map': 'a hash', 'method': 'sarsa', 'seed': 3}


class Entry(NamedTuple):
    """A message to a node."""

    step: int
    reward: float


class OtherEntry(NamedTuple):
    """A message to a node of another kind."""

    action: int


ENTRIES = [Entry(step, -step / 3) for step in range(5)]


@pytest.fixture
def open_store(tmp_path):
    """Return a function that makes stores in one folder; all are closed at the end."""
    made = []

    def make(name='learner', identity=IDENTITY, kinds=(Entry,), folder=tmp_path / 'state',
             added=None):
        made.append(CheckpointStore(folder, name, identity, kinds, added))
        return made[-1]
    yield make
    for store in made:
        store.close()


@pytest.fixture
def stored(open_store, tmp_path):
    """Return the folder of a store that was closed, with a checkpoint and five records."""
    store = open_store()
    write_checkpoint(store, 1)
    store.append(ENTRIES)
    store.close()
    return tmp_path / 'state'


def write_checkpoint(store, steps):
    """Write a checkpoint of so many steps."""
    store.write_checkpoint({'steps': steps}, {'q': np.full(3, float(steps))})


def loaded(store):
    """Return steps and records, checked against the array, None where nothing is stored."""
    found = store.load()
    if found is None:
        return None
    facts, arrays, entries = found
    assert list(facts) == ['steps'] and (arrays['q'] == facts['steps']).all()
    return facts['steps'], entries


def contents(folder):
    """Return the bytes of all files of a folder by name, but for the locks."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix != '.lock'}


def journal(folder):
    """Return the path of the journal."""
    path, = folder.glob('*.journal')
    return path


def rejected(open_store, **settings):
    """Return the message, of one line, with which a state is rejected."""
    with pytest.raises(StateError) as error:
        with closing(open_store(**settings)) as store:
            store.load()
    assert str(error.value).isprintable()
    return str(error.value)


def test_a_new_folder_holds_no_state(open_store):
    assert loaded(open_store()) is None


def test_a_setting_that_is_newer_than_a_state_had_one_value_then(open_store, stored):
    with closing(open_store(identity={'learns': True, **IDENTITY},
                            added={'learns': True})) as store:
        assert loaded(store) == (1, ENTRIES)
    assert 'was written with learns True, but this node has False' in rejected(
        open_store, identity={'learns': False, **IDENTITY}, added={'learns': True})


def test_a_stored_state_is_loaded_and_continued(open_store, stored):
    store = open_store()
    assert loaded(store) == (1, ENTRIES)
    store.append([Entry(5, 0.5)])
    store.close()
    assert loaded(open_store()) == (1, [*ENTRIES, Entry(5, 0.5)])


def test_a_new_checkpoint_replaces_the_journal(open_store, stored):
    store = open_store()
    loaded(store)
    before = journal(stored)
    write_checkpoint(store, 6)
    assert not before.exists() and journal(stored).read_bytes() == b''
    store.append([Entry(6, 0.0)])
    store.close()
    assert loaded(open_store()) == (6, [Entry(6, 0.0)])


def test_a_checkpoint_is_due_after_many_records_and_can_be_postponed(open_store, monkeypatch):
    monkeypatch.setattr(checkpoint_store, 'RECORDS_PER_CHECKPOINT', 100)
    store = open_store()
    write_checkpoint(store, 0)
    store.append(ENTRIES * 19)
    assert not store.is_checkpoint_due()
    store.append(ENTRIES)
    assert store.is_checkpoint_due()
    store.postpone_checkpoint()
    assert not store.is_checkpoint_due()
    store.append(ENTRIES * 2)
    assert store.is_checkpoint_due()


def test_a_journal_cut_at_any_byte_is_loaded_up_to_the_last_whole_record(open_store, stored):
    content = journal(stored).read_bytes()
    for size in range(len(content)):
        journal(stored).write_bytes(content[:size])
        with closing(open_store()) as store:
            assert loaded(store) == (1, ENTRIES[:size // 21])
        assert journal(stored).read_bytes() == content[:size // 21 * 21]


@fuzz
@given(data=st.data())
def test_a_flipped_bit_is_an_error_of_one_line_or_costs_the_last_record(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp('flipped')
    store = CheckpointStore(folder, 'learner', IDENTITY, (Entry,))
    write_checkpoint(store, 1)
    store.append(ENTRIES)
    store.close()
    path = data.draw(st.sampled_from(sorted(path for path in folder.iterdir()
                                            if path.suffix != '.lock')))
    whole = bytearray(path.read_bytes())
    bit = data.draw(st.integers(0, 8 * len(whole) - 1))
    whole[bit // 8] ^= 1 << bit % 8
    path.write_bytes(whole)
    before, store = contents(folder), CheckpointStore(folder, 'learner', IDENTITY, (Entry,))
    try:
        assert loaded(store) == (1, ENTRIES[:-1])
    except StateError as error:
        assert str(error).isprintable() and str(path) in str(error)
        assert contents(folder) == before
    finally:
        store.close()
        shutil.rmtree(folder)


@pytest.mark.parametrize('content', [
    b'', b'\0' * 100, b'comply_ros checkpoint, format 3\n', random.Random(0).randbytes(99)])
def test_a_file_that_is_no_checkpoint_is_rejected_and_left_untouched(open_store, stored, content):
    (stored / 'learner.checkpoint').write_bytes(content)
    before = contents(stored)
    assert 'learner.checkpoint must begin with' in rejected(open_store)
    assert contents(stored) == before


@pytest.mark.parametrize('identity, reason', [
    ({'map': 'another'}, "was written with map 'a hash', but this node has 'another'"),
    ({'method': 'watkins'}, "was written with method 'sarsa', but this node has 'watkins'"),
    ({'seed': 4}, 'was written with seed 3, but this node has 4'),
    ({'mentor': 'none'}, "was written with mentor None, but this node has 'none'")])
def test_the_state_of_another_node_is_rejected(open_store, stored, identity, reason):
    before = contents(stored)
    assert rejected(open_store, identity={**IDENTITY, **identity}) == (
        f'{stored}/learner.checkpoint {reason}: give another state_dir, or move learner.* away to '
        'start anew')
    assert contents(stored) == before


def test_the_state_of_a_node_with_more_settings_is_rejected_too(open_store, stored):
    del (fewer := dict(IDENTITY))['method']
    assert ("was written with method 'sarsa', but this node has None"
            in rejected(open_store, identity=fewer))


def test_a_state_of_format_1_is_rejected_and_left_untouched(open_store, tmp_path):
    folder = tmp_path / 'state'
    folder.mkdir()
    (folder / 'learner.snapshot').write_bytes(b'comply_ros snapshot 1\n' + b'0' * 64 + b'\nPK')
    (folder / 'learner.0123456789abcdef.journal').write_bytes(b'records')
    before = contents(folder)
    assert rejected(open_store) == (
        f'{folder}/learner.snapshot was written by an older version of comply_ros (format 1; this '
        'one reads format 3): give another state_dir, or move learner.* away to start anew')
    assert contents(folder) == before


@pytest.mark.parametrize('name, version, age, effect', [
    ('FORMAT', 1, 'a newer', ''), ('FORMAT', 4, 'an older', ''),
    ('ALGORITHM', 2, 'an older', ', so its bits would differ')])
def test_a_state_of_another_version_is_rejected_with_the_reason_and_left_untouched(
        open_store, stored, monkeypatch, name, version, age, effect):
    before = contents(stored)
    written = getattr(versions, f'{name}_VERSION')
    monkeypatch.setattr(checkpoint_bytes, f'{name}_VERSION', version)
    assert rejected(open_store) == (
        f'{stored}/learner.checkpoint was written by {age} version of comply_ros ({name.lower()} '
        f'{written}; this one reads {name.lower()} {version}){effect}: give another state_dir, or '
        'move learner.* away to start anew')
    assert contents(stored) == before


def test_the_journal_of_another_checkpoint_is_rejected(open_store, stored):
    own = journal(stored)
    store = open_store(name='other')
    write_checkpoint(store, 2)
    store.append([Entry(9, 9.0)])
    store.close()
    os.replace(next(stored.glob('other.*.journal')), own)
    assert 'record 1 at byte 0 does not match its checksum: give another' in rejected(open_store)


def test_the_journal_of_another_kind_of_node_is_rejected(open_store, stored):
    assert ('must be as it was written, but record 1 at byte 0'
            in rejected(open_store, kinds=(OtherEntry,)))


def test_a_folder_in_the_place_of_a_file_is_rejected(open_store, stored):
    path = journal(stored)
    path.unlink()
    path.mkdir()
    assert rejected(open_store) == f'{path} must be a file that can be read (is a directory)'
    (stored / 'learner.checkpoint').unlink()
    (stored / 'learner.checkpoint').mkdir()
    assert rejected(open_store).endswith('learner.checkpoint must be a file that can be read '
                                  '(is a directory)')


def denied(*names):
    """Return a function as `os.open`, to which the files of some names are forbidden."""
    real = os.open

    def open_file(path, *arguments, **settings):
        if any(name in str(path) for name in names):
            raise PermissionError(errno.EACCES, 'Permission denied', path)
        return real(path, *arguments, **settings)
    return open_file


def test_a_journal_that_cannot_be_written_is_rejected(open_store, stored, monkeypatch):
    store = open_store()
    monkeypatch.setattr(os, 'open', denied('.journal'))
    with pytest.raises(StateError, match=r'must be a journal that can be written \(permission de'):
        store.load()


def test_files_that_cannot_be_read_are_rejected(open_store, stored, monkeypatch):
    store = open_store()
    monkeypatch.setattr(Path, 'read_bytes', lambda path: denied('.checkpoint')(path, os.O_RDONLY))
    with pytest.raises(StateError, match=r'must be a file that can be read \(permission denied'):
        store.load()


@pytest.mark.parametrize('name, reason', [
    ('file', 'file exists'), ('file/deeper', 'not a directory'), ('x' * 300, 'file name too long'),
    ('~nobody-at-all/x', 'no such user'), ('a\0b', 'no file can have this name'),
    ('\ud800', 'no file can have this name')])
def test_a_folder_that_cannot_be_used_is_rejected(open_store, tmp_path, name, reason):
    (tmp_path / 'file').touch()
    folder = name if name.startswith('~') else f'{tmp_path}/{name}'
    assert rejected(open_store, folder=folder) == (
        f'state_dir must be a folder that can be written, got {folder!r} ({reason})')


def test_only_one_of_two_nodes_of_one_name_uses_a_folder_until_it_ends(open_store, stored):
    store = open_store()
    assert loaded(store) == (1, ENTRIES)
    assert rejected(open_store) == (
        f"state_dir '{stored}' is in use by another running learner: stop that one, or give this "
        'one another state_dir')
    open_store(name='mentor')
    store.close()
    assert loaded(open_store()) == (1, ENTRIES)


def test_a_node_leaves_the_files_of_others_alone_whatever_their_names(open_store, stored):
    others = [open_store(name=name) for name in ('learner.x', 'learner.learner', 'learner2')]
    for number, other in enumerate(others):
        write_checkpoint(other, number)
        other.append(ENTRIES)
    store = open_store()
    assert loaded(store) == (1, ENTRIES)
    write_checkpoint(store, 9)
    for other in others:
        other.close()
    assert loaded(open_store(name='learner.x')) == (0, ENTRIES)
    assert loaded(open_store(name='learner.learner')) == (1, ENTRIES)
    assert loaded(open_store(name='learner2')) == (2, ENTRIES)


def test_what_a_kill_left_of_a_checkpoint_is_deleted(open_store, stored):
    (stored / 'learner.checkpoint.4711.part').write_bytes(b'half of a check')
    assert loaded(open_store()) == (1, ENTRIES)
    assert not list(stored.glob('*.part'))


CALLS = ('open', 'fsync', 'replace', 'close', 'unlink')


class KilledError(BaseException):
    """The process ends here."""


def fail_at(monkeypatch, number, error):
    """Let the system call of that number fail, counted over all of `CALLS`; return the count."""
    calls = count()

    def failing(real):
        def call(*arguments, **settings):
            if threading.current_thread() is threading.main_thread() and next(calls) == number:
                raise error
            return real(*arguments, **settings)
        return call
    for name in CALLS:
        monkeypatch.setattr(os, name, failing(getattr(os, name)))
    return calls


def copied(folder, tmp_path):
    """Return a copy of a folder, as another process would find it after a kill."""
    return shutil.copytree(folder, tmp_path / 'copy')


@pytest.mark.parametrize('number', range(20))
@pytest.mark.parametrize('error', [OSError(errno.ENOSPC, 'No space left on device'),
                                   KilledError()], ids=['full', 'killed'])
def test_a_checkpoint_that_fails_between_two_system_calls_loses_nothing(
        open_store, stored, tmp_path, monkeypatch, error, number):
    monkeypatch.setattr(checkpoint_store, 'SYNC_PERIOD', 1000.0)
    store = open_store()
    loaded(store)
    with monkeypatch.context() as patched:
        calls = fail_at(patched, number, error)
        try:
            write_checkpoint(store, 6)
        except (OSError, KilledError):
            failed = True
        else:
            failed = False
        made = next(calls)
    found = loaded(open_store(folder=copied(stored, tmp_path)))
    assert found in ([(1, ENTRIES), (6, [])] if failed else [(6, [])])
    assert failed or store.sync_error or made <= number, 'a failure that is not reported'
    if store.sync_error:  # the new one may be lost with the power: another is written
        write_checkpoint(store, 6)
    store.append([Entry(7, 0.25)])  # and so it goes on in the same process
    store.close()
    steps, entries = loaded(open_store())
    assert (steps, entries) in ([(1, [*ENTRIES, Entry(7, 0.25)]), (6, [Entry(7, 0.25)])])


def test_no_failure_leaves_a_descriptor_open(open_store, stored, monkeypatch):
    store = open_store()
    loaded(store)
    before = len(os.listdir('/proc/self/fd'))
    monkeypatch.setattr(os, 'replace', denied('.part'))
    for _ in range(3):
        with pytest.raises(PermissionError):
            write_checkpoint(store, 6)
    assert len(os.listdir('/proc/self/fd')) == before
    with pytest.raises(StateError):
        open_store()
    assert len(os.listdir('/proc/self/fd')) == before


def written_by(real, limit):
    """Return a function as `os.write`, on a disk that has room for so many bytes more."""
    left = [limit]

    def write(file, content):
        if not left[0]:
            raise OSError(errno.ENOSPC, 'No space left on device')
        size = real(file, content[:left[0]])
        left[0] -= size
        return size
    return write


@pytest.mark.parametrize('room', range(0, 42, 5))
def test_a_record_that_filled_the_disk_is_completed_when_there_is_room(
        open_store, stored, monkeypatch, room):
    store = open_store()
    loaded(store)
    with monkeypatch.context() as patched:
        patched.setattr(os, 'write', written_by(os.write, room))
        for msg in ([Entry(5, 1.0), Entry(6, 1.0)], [Entry(7, 1.0)], []):
            with pytest.raises(OSError, match='No space left'):
                store.append(msg)
    store.append([])
    store.close()
    assert store.journal_bytes == journal(stored).stat().st_size
    assert loaded(open_store()) == (1, [*ENTRIES, *(Entry(step, 1.0) for step in (5, 6, 7))])


def test_writes_of_one_byte_at_a_time_are_continued(open_store, stored, monkeypatch):
    store, real = open_store(), os.write
    loaded(store)
    monkeypatch.setattr(os, 'write', lambda file, content: real(file, content[:1]))
    store.append([Entry(5, 1.0)])
    store.close()
    assert loaded(open_store()) == (1, [*ENTRIES, Entry(5, 1.0)])


def test_a_new_checkpoint_after_a_full_disk_does_not_need_the_old_journal(
        open_store, stored, monkeypatch):
    store = open_store()
    loaded(store)
    with monkeypatch.context() as patched:
        patched.setattr(os, 'write', written_by(os.write, 5))
        with pytest.raises(OSError, match='No space left'):
            store.append([Entry(5, 1.0)])
    write_checkpoint(store, 6)
    store.append([Entry(6, 1.0)])
    store.close()
    assert loaded(open_store()) == (6, [Entry(6, 1.0)])


@pytest.mark.parametrize('take', [shutil.rmtree, lambda folder: folder.rename(folder / '../old'),
                                  lambda folder: journal(folder).unlink(),
                                  lambda folder: (folder / 'learner.checkpoint').unlink()],
                         ids=['folder', 'moved', 'journal', 'checkpoint'])
def test_removed_files_are_noticed_and_written_anew(open_store, stored, take):
    store = open_store()
    assert not store.was_removed()
    loaded(store)
    assert not store.was_removed()
    take(stored)
    assert store.was_removed()
    write_checkpoint(store, 6)
    assert not store.was_removed()
    store.append([Entry(6, 1.0)])
    assert 'is in use by another running learner' in rejected(open_store)
    store.close()
    assert loaded(open_store()) == (6, [Entry(6, 1.0)])


def test_another_file_in_the_place_of_the_journal_is_noticed(open_store, stored):
    store = open_store()
    loaded(store)
    content, path = journal(stored).read_bytes(), journal(stored)
    path.unlink()
    path.write_bytes(content)
    assert store.was_removed()


def test_a_folder_that_another_node_uses_now_is_left_to_it(open_store, stored):
    store = open_store()
    loaded(store)
    shutil.rmtree(stored)
    other = open_store()
    write_checkpoint(other, 8)
    with pytest.raises(OSError) as error:
        write_checkpoint(store, 6)
    assert error.value.strerror == 'another learner uses it'
    other.close()
    assert loaded(open_store(folder=stored)) == (8, [])


def test_a_folder_that_nobody_can_look_into_is_not_removed(open_store, stored, monkeypatch):
    store = open_store()
    loaded(store)
    monkeypatch.setattr(os, 'stat', denied(''))
    assert not store.was_removed()


def test_a_failed_sync_of_a_folder_is_reported_and_the_new_checkpoint_counts(
        open_store, stored, monkeypatch):
    monkeypatch.setattr(checkpoint_store, 'SYNC_PERIOD', 1000.0)
    store = open_store()
    loaded(store)
    with monkeypatch.context() as patched:
        patched.setattr(checkpoint_store, 'sync_folder', failing(OSError(errno.EIO, 'lost')))
        write_checkpoint(store, 6)
    assert store.sync_error.strerror == 'lost'
    store.close()
    assert loaded(open_store()) == (6, [])


def test_closing_twice_is_closing_once(open_store, stored):
    for store in (open_store(name='fresh'), open_store()):
        store.load()
        store.close()
        store.close()
    assert loaded(open_store()) == (1, ENTRIES)


def test_a_new_checkpoint_closes_no_file_during_its_sync(open_store, monkeypatch):
    monkeypatch.setattr(checkpoint_store, 'SYNC_PERIOD', 0.0)
    bad, real = [], os.fdatasync

    def sync(file):
        try:
            real(file)
        except OSError as error:
            bad.append(error)
    monkeypatch.setattr(os, 'fdatasync', sync)
    store = open_store()
    for steps in range(100):
        write_checkpoint(store, steps)
        store.append(ENTRIES)
    store.close()
    assert not bad
    assert loaded(open_store()) == (99, ENTRIES)


def test_a_loss_of_the_disk_is_an_error_until_there_is_a_new_checkpoint(
        open_store, monkeypatch):
    store = open_store()
    write_checkpoint(store, 1)
    store.append(ENTRIES)
    monkeypatch.setattr(os, 'fdatasync', failing(OSError(errno.ENOSPC, 'No space left')))
    store.sync()
    monkeypatch.undo()
    store.sync()
    for _ in range(2):
        with pytest.raises(OSError, match='No space left'):
            store.append(ENTRIES)
    write_checkpoint(store, 2)
    store.append(ENTRIES)


def failing(error):
    """Return a function that raises."""
    def fail(*_):
        raise error
    return fail
