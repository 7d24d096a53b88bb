# SPDX-License-Identifier: Apache-2.0
"""Compiled code: where it is cached, and what happens where it cannot be."""

import os
from pathlib import Path
import shutil
import subprocess
import sys

import pytest

from comply_ros.storage import kernel_cache
from comply_ros.storage.kernel_cache import kernel_hash, KernelCache

PROGRAM = ('import sys; {}; from comply_ros.numerics.jit import compiled;'
           'from comply_ros.learner.confidence import sigmoid; f = compiled(sigmoid);'
           'print(f(1.0), f is sigmoid)')
WITH_CACHE = 'from comply_ros.storage.kernel_cache import use_kernel_cache; use_kernel_cache()'


def run(setup):
    """Return what a fresh interpreter prints for the sigmoid of 1, and whether it is plain."""
    done = subprocess.run([sys.executable, '-c', PROGRAM.format(setup)], check=True,
                          capture_output=True, text=True)
    value, plain = done.stdout.split()
    return float(value), plain == 'True'


def test_without_numba_the_kernel_itself_is_returned():
    value, plain = run('sys.modules["numba"] = None')
    assert plain
    assert (value, False) == run(WITH_CACHE)


def test_nothing_is_written_until_a_cache_is_given(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))
    monkeypatch.setenv('HOME', str(tmp_path))
    assert not run('pass')[1]
    assert not list(tmp_path.iterdir())


def test_compiled_code_is_cached_by_the_content_of_the_sources(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    run(WITH_CACHE)
    folder = tmp_path / 'comply_ros' / 'kernels' / kernel_hash()[:16]
    assert list(folder.rglob('*.nbi'))


def test_the_hash_is_of_every_room_with_kernels_and_of_no_other(tmp_path, monkeypatch):
    assert set(kernel_cache.ROOMS) == {
        path.parent.name for path in kernel_cache.PACKAGE.rglob('*.py')
        if '\n@kernel\n' in path.read_text()}
    package = tmp_path / 'comply_ros'
    shutil.copytree(kernel_cache.PACKAGE, package)
    monkeypatch.setattr(kernel_cache, 'PACKAGE', package)
    before = kernel_hash()
    for room in kernel_cache.ROOMS:
        path = next((package / room).glob('[a-z]*.py'))
        path.write_text(path.read_text() + '# A comment.\n')
        assert kernel_hash() != before
        before = kernel_hash()
    (package / 'nodes' / 'learner.py').write_text('')
    assert kernel_hash() == before
    (package / 'world' / 'grid.py').rename(package / 'world' / 'grids.py')
    assert kernel_hash() != before


def test_the_folders_of_sources_that_were_not_used_lately_are_deleted(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    folder = Path(KernelCache().folder())
    old = [folder.with_name(f'{number:016}') for number in range(9)]
    for number, path in enumerate((*old, folder)):
        path.mkdir(exist_ok=True)
        (path / 'code.nbi').touch()
        os.utime(path, (number, number))
    os.utime(folder, (0, 0))  # the oldest until it is used
    assert Path(KernelCache().folder()) == folder
    assert set(folder.parent.iterdir()) == {folder, *old[-kernel_cache.FOLDERS_KEPT + 1:]}


def test_a_cleared_cache_has_no_code_of_these_sources_and_all_of_others(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    folder = Path(KernelCache().folder())
    (folder / 'code.nbi').touch()
    other = folder.with_name('of another version')
    other.mkdir()
    KernelCache().clear()
    assert list(folder.parent.iterdir()) == [other]


@pytest.mark.long
def test_the_next_process_uses_the_compiled_code_and_compiles_again_where_it_is_spoiled(
        tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    program = (f'{WITH_CACHE}; from comply_ros.numerics.jit import run_compiled, specialized;'
               'from comply_ros.learner.confidence import sigmoid;'
               'print({}(sigmoid, 1.0){})')

    def results():
        return [subprocess.run([sys.executable, '-c', program.format(*how)], check=True,
                               capture_output=True, text=True).stdout
                for how in (('run_compiled', ''), ('specialized', '(1.0)'))]

    def files():
        return {path: path.stat().st_mtime_ns for path in tmp_path.rglob('*.nb?')}
    first, compiled = results(), files()
    assert compiled
    assert results() == first
    assert files() == compiled
    for content in (b'', b'spoiled'):
        for path in compiled:
            path.write_bytes(content)
        assert results() == first
        assert all(path.stat().st_size > len(content) for path in files())


def test_what_is_not_in_the_cache_is_not_compiled_to_be_loaded(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    program = (f'{WITH_CACHE}; from comply_ros.numerics.jit import cached, specialized;'
               'from comply_ros.learner.confidence import sigmoid;'
               'found = cached(sigmoid, 1.0); print(found and found(1.0));'
               'print(specialized(sigmoid, 1.0)(1.0))')
    first, second = (subprocess.run([sys.executable, '-c', program], check=True,
                                    capture_output=True, text=True).stdout.split()
                     for _ in range(2))
    assert (first[0], first[1]) == ('None', second[0])


@pytest.mark.long
def test_a_cache_that_cannot_be_written_is_no_reason_to_stop(tmp_path, monkeypatch):
    (tmp_path / 'comply_ros').write_text('a file where a folder should be')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    assert KernelCache().folder() is None
    assert not run(WITH_CACHE)[1]
