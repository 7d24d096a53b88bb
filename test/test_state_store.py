# SPDX-License-Identifier: Apache-2.0
"""What is kept can be recalled, whatever happened to the process, the disk or the files."""

from contextlib import closing
import errno
from itertools import count
import os
from pathlib import Path
import random
import shutil
import threading
from typing import NamedTuple

from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from comply_ros.storage import state_store
from comply_ros.storage.state_store import StateError, StateStore

settings.register_profile('keeping', deadline=None, max_examples=150, database=None,
                          derandomize=os.environ.get('CI') == 'true',
                          suppress_health_check=list(HealthCheck))
fuzz = settings(settings.get_profile('keeping'))
IDENTITY = {'map': 'a hash', 'method': 'sarsa', 'seed': 3}


class Told(NamedTuple):
    """What a node was told."""

    step: int
    reward: float


class Other(NamedTuple):
    """What a node of another kind was told."""

    action: int


TOLD = [Told(step, -step / 3) for step in range(5)]


@pytest.fixture
def keep(tmp_path):
    """Return a function that makes keepers in one folder; all are closed at the end."""
    made = []

    def make(name='learner', identity=IDENTITY, kinds=(Told,), folder=tmp_path / 'state'):
        made.append(StateStore(folder, name, identity, kinds))
        return made[-1]
    yield make
    for keeper in made:
        keeper.close()


@pytest.fixture
def kept(keep, tmp_path):
    """Return the folder of a keeper that was closed, with a snapshot and five records."""
    keeper = keep()
    begin(keeper, 1)
    keeper.keep(TOLD)
    keeper.close()
    return tmp_path / 'state'


def begin(keeper, steps):
    """Write a snapshot of so many steps."""
    keeper.begin({'steps': steps}, {'q': np.full(3, float(steps))})


def recalled(keeper):
    """Return steps and records, checked against the array, None where nothing is kept."""
    found = keeper.recall()
    if found is None:
        return None
    facts, arrays, told = found
    assert list(facts) == ['steps'] and (arrays['q'] == facts['steps']).all()
    return facts['steps'], told


def contents(folder):
    """Return the bytes of all files of a folder by name, but for the locks."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix != '.lock'}


def journal(folder):
    """Return the path of the journal."""
    path, = folder.glob('*.journal')
    return path


def refused(keep, **settings):
    """Return the message, of one line, with which a state is refused."""
    with pytest.raises(StateError) as error:
        with closing(keep(**settings)) as keeper:
            keeper.recall()
    assert str(error.value).isprintable()
    return str(error.value)


def test_nothing_was_kept_in_a_new_folder(keep):
    assert recalled(keep()) is None


def test_what_was_kept_comes_back_and_is_gone_on_from(keep, kept):
    keeper = keep()
    assert recalled(keeper) == (1, TOLD)
    keeper.keep([Told(5, 0.5)])
    keeper.close()
    assert recalled(keep()) == (1, [*TOLD, Told(5, 0.5)])


def test_a_new_snapshot_takes_the_place_of_the_journal(keep, kept):
    keeper = keep()
    recalled(keeper)
    before = journal(kept)
    begin(keeper, 6)
    assert not before.exists() and journal(kept).read_bytes() == b''
    keeper.keep([Told(6, 0.0)])
    keeper.close()
    assert recalled(keep()) == (6, [Told(6, 0.0)])


def test_a_snapshot_is_due_after_many_records_and_can_be_put_off(keep, monkeypatch):
    monkeypatch.setattr(state_store, 'EVERY', 100)
    keeper = keep()
    begin(keeper, 0)
    keeper.keep(TOLD * 19)
    assert not keeper.is_due()
    keeper.keep(TOLD)
    assert keeper.is_due()
    keeper.put_off()
    assert not keeper.is_due()
    keeper.keep(TOLD * 2)
    assert keeper.is_due()


def test_a_journal_cut_at_any_byte_is_used_up_to_the_last_whole_record(keep, kept):
    content = journal(kept).read_bytes()
    for size in range(len(content)):
        journal(kept).write_bytes(content[:size])
        with closing(keep()) as keeper:
            assert recalled(keeper) == (1, TOLD[:size // 21])
        assert journal(kept).read_bytes() == content[:size // 21 * 21]


@fuzz
@given(data=st.data())
def test_a_flipped_bit_is_an_error_of_one_line_or_at_the_end_a_record_less(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp('flipped')
    keeper = StateStore(folder, 'learner', IDENTITY, (Told,))
    begin(keeper, 1)
    keeper.keep(TOLD)
    keeper.close()
    path = data.draw(st.sampled_from(sorted(path for path in folder.iterdir()
                                            if path.suffix != '.lock')))
    whole = bytearray(path.read_bytes())
    bit = data.draw(st.integers(0, 8 * len(whole) - 1))
    whole[bit // 8] ^= 1 << bit % 8
    path.write_bytes(whole)
    before, keeper = contents(folder), StateStore(folder, 'learner', IDENTITY, (Told,))
    try:
        assert recalled(keeper) == (1, TOLD[:-1])
    except StateError as error:
        assert str(error).isprintable() and str(path) in str(error)
        assert contents(folder) == before
    finally:
        keeper.close()
        shutil.rmtree(folder)


@pytest.mark.parametrize('content', [
    b'', b'\0' * 100, b'comply_ros snapshot 1\n', random.Random(0).randbytes(99)])
def test_a_file_that_is_no_snapshot_is_refused_and_left_untouched(keep, kept, content):
    (kept / 'learner.snapshot').write_bytes(content)
    before = contents(kept)
    assert 'learner.snapshot must be' in refused(keep)
    assert contents(kept) == before


@pytest.mark.parametrize('identity, reason', [
    ({'map': 'another'}, "was kept with map 'a hash', and here it is 'another'"),
    ({'method': 'watkins'}, "was kept with method 'sarsa', and here it is 'watkins'"),
    ({'seed': 4}, 'was kept with seed 3, and here it is 4'),
    ({'mentor': 'none'}, "was kept with mentor None, and here it is 'none'")])
def test_a_state_of_another_node_is_refused_with_the_reason(keep, kept, identity, reason):
    before = contents(kept)
    assert refused(keep, identity={**IDENTITY, **identity}) == (
        f'{kept}/learner.snapshot {reason}: give another state_dir, or move it away to begin anew')
    assert contents(kept) == before


def test_the_state_of_a_node_that_is_set_by_more_is_refused_too(keep, kept):
    del (fewer := dict(IDENTITY))['method']
    assert "was kept with method 'sarsa', and here it is None" in refused(keep, identity=fewer)


def test_a_state_of_another_version_is_refused(keep, kept, monkeypatch):
    monkeypatch.setattr(state_store, '__version__', '99')
    assert "was kept with version '0.1.0 (" in refused(keep)


def test_the_journal_of_another_snapshot_is_not_used(keep, kept):
    own = journal(kept)
    keeper = keep(name='other')
    begin(keeper, 2)
    keeper.keep([Told(9, 9.0)])
    keeper.close()
    os.replace(next(kept.glob('other.*.journal')), own)
    assert 'record 1 at byte 0 does not fit its checksum: move learner.* away' in refused(keep)


def test_a_journal_of_another_kind_of_node_is_refused(keep, kept):
    assert 'is damaged: record 1 at byte 0' in refused(keep, kinds=(Other,))


def test_a_folder_in_the_place_of_a_file_is_refused(keep, kept):
    path = journal(kept)
    path.unlink()
    path.mkdir()
    assert refused(keep) == f'{path} must be a file that can be read (is a directory)'
    (kept / 'learner.snapshot').unlink()
    (kept / 'learner.snapshot').mkdir()
    assert refused(keep).endswith('learner.snapshot must be a file that can be read '
                                  '(is a directory)')


def denied(*names):
    """Return a function as `os.open`, to which the files of some names are forbidden."""
    real = os.open

    def open_file(path, *arguments, **settings):
        if any(name in str(path) for name in names):
            raise PermissionError(errno.EACCES, 'Permission denied', path)
        return real(path, *arguments, **settings)
    return open_file


def test_a_journal_that_cannot_be_written_is_refused(keep, kept, monkeypatch):
    keeper = keep()
    monkeypatch.setattr(os, 'open', denied('.journal'))
    with pytest.raises(StateError, match=r'must be a journal that can be written \(permission de'):
        keeper.recall()


def test_files_that_cannot_be_read_are_refused(keep, kept, monkeypatch):
    keeper = keep()
    monkeypatch.setattr(Path, 'read_bytes', lambda path: denied('.snapshot')(path, os.O_RDONLY))
    with pytest.raises(StateError, match=r'must be a file that can be read \(permission denied'):
        keeper.recall()


@pytest.mark.parametrize('name, reason', [
    ('file', 'file exists'), ('file/deeper', 'not a directory'), ('x' * 300, 'file name too long'),
    ('~nobody-at-all/x', 'no such user'), ('a\0b', 'no folder can have this name'),
    ('\ud800', 'no folder can have this name')])
def test_a_folder_that_cannot_be_is_refused(keep, tmp_path, name, reason):
    (tmp_path / 'file').touch()
    folder = name if name.startswith('~') else f'{tmp_path}/{name}'
    assert refused(keep, folder=folder) == (
        f'state_dir must be a folder that can be written, got {folder!r} ({reason})')


def test_two_nodes_of_one_name_are_told_apart_until_one_ends(keep, kept):
    keeper = keep()
    assert recalled(keeper) == (1, TOLD)
    assert refused(keep) == (f"state_dir '{kept}' is used by another learner that runs: end it, "
                             'or give this one another state_dir')
    keep(name='mentor')
    keeper.close()
    assert recalled(keep()) == (1, TOLD)


def test_a_node_leaves_the_files_of_others_alone_whatever_their_names(keep, kept):
    others = [keep(name=name) for name in ('learner.x', 'learner.learner', 'learner2')]
    for number, other in enumerate(others):
        begin(other, number)
        other.keep(TOLD)
    keeper = keep()
    assert recalled(keeper) == (1, TOLD)
    begin(keeper, 9)
    for other in others:
        other.close()
    assert recalled(keep(name='learner.x')) == (0, TOLD)
    assert recalled(keep(name='learner.learner')) == (1, TOLD)
    assert recalled(keep(name='learner2')) == (2, TOLD)


def test_what_a_kill_left_of_a_snapshot_is_deleted_with_the_next(keep, kept):
    (kept / 'learner.snapshot.4711.part').write_bytes(b'half of a snap')
    assert recalled(keep()) == (1, TOLD)
    assert not list(kept.glob('*.part'))


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
def test_a_snapshot_that_fails_between_two_system_calls_loses_nothing(
        keep, kept, tmp_path, monkeypatch, error, number):
    monkeypatch.setattr(state_store, 'SYNC', 1000.0)
    keeper = keep()
    recalled(keeper)
    with monkeypatch.context() as patched:
        calls = fail_at(patched, number, error)
        try:
            begin(keeper, 6)
        except (OSError, KilledError):
            failed = True
        else:
            failed = False
        made = next(calls)
    found = recalled(keep(folder=copied(kept, tmp_path)))
    assert found in ([(1, TOLD), (6, [])] if failed else [(6, [])])
    assert failed or keeper.trouble or made <= number, 'a failure that is not told'
    if keeper.trouble:  # the new one may be lost with the power: another is written
        begin(keeper, 6)
    keeper.keep([Told(7, 0.25)])  # and so it goes on in the same process
    keeper.close()
    steps, told = recalled(keep())
    assert (steps, told) in ([(1, [*TOLD, Told(7, 0.25)]), (6, [Told(7, 0.25)])])


def test_no_descriptor_is_left_open_by_what_fails(keep, kept, monkeypatch):
    keeper = keep()
    recalled(keeper)
    before = len(os.listdir('/proc/self/fd'))
    monkeypatch.setattr(os, 'replace', denied('.part'))
    for _ in range(3):
        with pytest.raises(PermissionError):
            begin(keeper, 6)
    assert len(os.listdir('/proc/self/fd')) == before
    with pytest.raises(StateError):
        keep()
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
def test_a_disk_that_fills_up_in_a_record_is_written_on_when_there_is_room(
        keep, kept, monkeypatch, room):
    keeper = keep()
    recalled(keeper)
    with monkeypatch.context() as patched:
        patched.setattr(os, 'write', written_by(os.write, room))
        for msg in ([Told(5, 1.0), Told(6, 1.0)], [Told(7, 1.0)], []):
            with pytest.raises(OSError, match='No space left'):
                keeper.keep(msg)
    keeper.keep([])
    keeper.close()
    assert keeper.size == journal(kept).stat().st_size
    assert recalled(keep()) == (1, [*TOLD, *(Told(step, 1.0) for step in (5, 6, 7))])


def test_writes_that_take_a_byte_at_a_time_are_gone_on_with(keep, kept, monkeypatch):
    keeper, real = keep(), os.write
    recalled(keeper)
    monkeypatch.setattr(os, 'write', lambda file, content: real(file, content[:1]))
    keeper.keep([Told(5, 1.0)])
    keeper.close()
    assert recalled(keep()) == (1, [*TOLD, Told(5, 1.0)])


def test_a_new_snapshot_after_a_full_disk_needs_nothing_of_the_old_journal(
        keep, kept, monkeypatch):
    keeper = keep()
    recalled(keeper)
    with monkeypatch.context() as patched:
        patched.setattr(os, 'write', written_by(os.write, 5))
        with pytest.raises(OSError, match='No space left'):
            keeper.keep([Told(5, 1.0)])
    begin(keeper, 6)
    keeper.keep([Told(6, 1.0)])
    keeper.close()
    assert recalled(keep()) == (6, [Told(6, 1.0)])


@pytest.mark.parametrize('take', [shutil.rmtree, lambda folder: folder.rename(folder / '../old'),
                                  lambda folder: journal(folder).unlink(),
                                  lambda folder: (folder / 'learner.snapshot').unlink()],
                         ids=['folder', 'moved', 'journal', 'snapshot'])
def test_what_was_taken_away_is_noticed_and_kept_anew(keep, kept, take):
    keeper = keep()
    assert not keeper.is_lost()
    recalled(keeper)
    assert not keeper.is_lost()
    take(kept)
    assert keeper.is_lost()
    begin(keeper, 6)
    assert not keeper.is_lost()
    keeper.keep([Told(6, 1.0)])
    assert 'is used by another learner' in refused(keep)
    keeper.close()
    assert recalled(keep()) == (6, [Told(6, 1.0)])


def test_another_file_in_the_place_of_the_journal_is_noticed(keep, kept):
    keeper = keep()
    recalled(keeper)
    content, path = journal(kept).read_bytes(), journal(kept)
    path.unlink()
    path.write_bytes(content)
    assert keeper.is_lost()


def test_a_folder_that_another_node_has_taken_over_is_left_to_it(keep, kept):
    keeper = keep()
    recalled(keeper)
    shutil.rmtree(kept)
    other = keep()
    begin(other, 8)
    with pytest.raises(OSError) as error:
        begin(keeper, 6)
    assert error.value.strerror == 'another learner uses it'
    other.close()
    assert recalled(keep(folder=kept)) == (8, [])


def test_a_folder_in_which_nobody_may_look_is_not_taken_for_lost(keep, kept, monkeypatch):
    keeper = keep()
    recalled(keeper)
    monkeypatch.setattr(os, 'stat', denied(''))
    assert not keeper.is_lost()


def test_a_folder_that_cannot_be_synced_is_told_and_the_new_snapshot_counts(
        keep, kept, monkeypatch):
    monkeypatch.setattr(state_store, 'SYNC', 1000.0)
    keeper = keep()
    recalled(keeper)
    with monkeypatch.context() as patched:
        patched.setattr(state_store, 'write_names_through', failing(OSError(errno.EIO, 'lost')))
        begin(keeper, 6)
    assert keeper.trouble.strerror == 'lost'
    keeper.close()
    assert recalled(keep()) == (6, [])


def test_to_close_twice_is_to_close_once(keep, kept):
    for keeper in (keep(name='fresh'), keep()):
        keeper.recall()
        keeper.close()
        keeper.close()
    assert recalled(keep()) == (1, TOLD)


def test_many_snapshots_while_the_disk_is_synced_close_no_file_under_the_sync(keep, monkeypatch):
    monkeypatch.setattr(state_store, 'SYNC', 0.0)
    bad, real = [], os.fdatasync

    def sync(file):
        try:
            real(file)
        except OSError as error:
            bad.append(error)
    monkeypatch.setattr(os, 'fdatasync', sync)
    keeper = keep()
    for steps in range(100):
        begin(keeper, steps)
        keeper.keep(TOLD)
    keeper.close()
    assert not bad
    assert recalled(keep()) == (99, TOLD)


def test_what_the_disk_lost_after_it_was_written_is_an_error_until_there_is_a_new_snapshot(
        keep, monkeypatch):
    keeper = keep()
    begin(keeper, 1)
    keeper.keep(TOLD)
    monkeypatch.setattr(os, 'fdatasync', failing(OSError(errno.ENOSPC, 'No space left')))
    keeper._sync_once()
    monkeypatch.undo()
    keeper._sync_once()
    for _ in range(2):
        with pytest.raises(OSError, match='No space left'):
            keeper.keep(TOLD)
    begin(keeper, 2)
    keeper.keep(TOLD)


def failing(error):
    """Return a function that raises."""
    def fail(*_):
        raise error
    return fail
