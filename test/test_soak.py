# SPDX-License-Identifier: Apache-2.0
"""The soak: what the nodes hold stays as it is, and a node that leaks is caught."""

import os
from pathlib import Path
import random
import re
import signal
import subprocess
import sys

from node_processes import wait_until
import pytest

from tools import soak

STEPS, AFTER = 50_000, 20_000  # a million, and 50,000, by hand: `scripts/soak`
COMMAND = (sys.executable, '-m', 'tools.soak')


def readings_of(mb):
    """Return a reading each 2,000 steps up to a million, with mb(steps)."""
    return [(steps, mb(steps)) for steps in range(0, 1_000_001, 2_000)]


def noisy(steps, leak=0.0):
    """Return MB of a node that leaks so much a step, and now and then makes a snapshot."""
    caches = 60.0 + 20.0 * min(1.0, steps / 30_000)
    snapshot = 30.0 if steps % 50_000 == 0 else 0.0
    return caches + snapshot + leak * steps + random.Random(steps).uniform(-0.3, 0.3)


@pytest.mark.usefixtures('domain')
def test_no_node_grows_while_it_learns_with_a_state_dir(tmp_path, monkeypatch):
    monkeypatch.delenv('ROS_PYTHON_CHECK_FIELDS')
    done = subprocess.run(
        [*COMMAND, '--mentor', 'noisy:0.3', '--steps', str(STEPS), '--after', str(AFTER), '--out',
         str(tmp_path)], capture_output=True, text=True, timeout=170, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr.endswith('It held: no node grew by 5 MB.\n')
    rows = dict(re.findall(r'(?m)^(grid_world|mentor|learner) .* ([+-][\d.]+) *$', done.stderr))
    assert set(rows) == {'grid_world', 'mentor', 'learner'}
    assert all(float(grown) < 5.0 for grown in rows.values())
    kept = {path.name.split('.')[1] for path in (tmp_path / 'state').glob('*.journal')}
    assert kept == {'grid_world', 'learner'}  # this mentor has nothing to keep


def test_caches_snapshots_and_noise_are_no_growth():
    first, last = soak.held(readings_of(noisy), 50_000)
    assert abs(first - 80.0) < 0.3 and abs(last - first) < 0.3


def test_six_bytes_a_step_are_caught_and_four_are_not(capsys):
    def table(leak):
        return {'grid_world': readings_of(noisy),
                'learner': readings_of(lambda steps: noisy(steps, leak * 1e-6))}
    assert soak.verdict(table(4), 50_000) == 0
    assert 'It held: no node grew by 5 MB.' in capsys.readouterr().err
    assert soak.verdict(table(6), 50_000) == 1
    msg = capsys.readouterr().err
    assert re.search(r'learner must grow by less than 5 MB, and grew by 5\.\d', msg)
    assert 'grid_world must' not in msg


def test_a_window_without_a_reading_is_no_proof():
    with pytest.raises(soak.SoakFailed, match='between 50,000 and 60,000 steps, got 2 readings'):
        soak.held([(49_000, 60.0), (70_000, 60.0)], 50_000)
    with pytest.raises(soak.SoakFailed, match='got 0 readings up to 0'):
        soak.held([], 50_000)


def test_memory_is_what_the_process_holds():
    before = soak.memory(os.getpid())
    block = bytearray(b'x' * 40_000_000)
    assert 39.0 < soak.memory(os.getpid()) - before < 42.0
    assert len(block) == 40_000_000


@pytest.mark.usefixtures('domain')
def test_ctrl_c_ends_a_soak_and_its_nodes(tmp_path):
    process = subprocess.Popen([*COMMAND, '--map', 'bar_grid', '--out', str(tmp_path)],
                               stderr=subprocess.PIPE, text=True, start_new_session=True)
    logs = [tmp_path / f'{name}.log' for name in ('grid_world', 'mentor', 'learner')]
    wait_until(lambda: all(log.exists() and 'ready' in log.read_text() for log in logs), 'nodes')
    ids = Path(f'/proc/{process.pid}/task/{process.pid}/children').read_text().split()
    process.send_signal(signal.SIGINT)
    msg = process.communicate(timeout=30)[1]
    assert process.returncode == 130
    assert msg.endswith('soak: interrupted\n') and 'Traceback' not in msg
    assert len(ids) == 3 and not any(os.path.exists(f'/proc/{pid}') for pid in ids)


@pytest.mark.parametrize('argv, message', [
    (('--steps', '60000'), 'soak: steps must be at least 20,000 more than after, and after at '
                           'least 0, got 60,000 and 50,000'),
    (('--after', '-1'), 'soak: steps must be at least 20,000 more than after'),
    (('--iterations', '3'), 'soak: a soak goes on for --steps: iterations must not be given'),
    (('--map', 'nowhere'), "soak: map 'nowhere': a map must be one of"),
])
def test_a_mistake_is_said_before_anything_is_started(tmp_path, capsys, argv, message):
    assert soak.main(['soak', *argv, '--out', str(tmp_path)]) == 2
    msg = capsys.readouterr().err
    assert msg.startswith(message) and msg.count('\n') == 1
    assert not (tmp_path / 'learner.log').exists()
