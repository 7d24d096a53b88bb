# SPDX-License-Identifier: Apache-2.0
"""Compiled code: where it is kept, and what happens where it cannot be had."""

from pathlib import Path
import subprocess
import sys

from comply_ros.numerics import jit

TRAIN = ('import sys; {}; from comply_ros.numerics.jit import compiled;'
         'from comply_ros.learner.confidence import sigmoid; f = compiled(sigmoid);'
         'print(f(1.0), f is sigmoid)')


def run(setup, **environment):
    """Return what a fresh interpreter prints for the sigmoid of 1, and whether it is plain."""
    done = subprocess.run([sys.executable, '-c', TRAIN.format(setup)], check=True,
                          capture_output=True, text=True, env=environment or None)
    value, plain = done.stdout.split()
    return float(value), plain == 'True'


def test_without_numba_the_kernel_itself_is_returned():
    value, plain = run('sys.modules["numba"] = None')
    assert plain
    assert (value, False) == run('pass')


def test_compiled_code_is_kept_by_the_state_of_the_sources(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    run('pass')
    folder = tmp_path / 'comply_ros' / 'kernels' / jit.source_hash()[:16]
    assert list(folder.rglob('*.nbi'))


def test_a_spoiled_cache_is_made_anew(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    train = ('from test_training import trained;'
             'print(trained("sarsa", "report", iterations=1)[0].state.digest())')
    msg = set()
    for spoil in (None, b'', b'spoiled'):
        for path in tmp_path.rglob('*.nb?'):
            path.write_bytes(spoil)
        msg.add(subprocess.run([sys.executable, '-c', train], check=True, capture_output=True,
                                text=True, cwd=Path(__file__).parent).stdout)
    assert len(msg) == 1


def test_a_cache_that_cannot_be_written_is_no_reason_to_stop(tmp_path, monkeypatch):
    (tmp_path / 'comply_ros').write_text('a file where a folder should be')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    assert not run('pass')[1]
