# SPDX-License-Identifier: Apache-2.0
"""`scripts/soak`: the memory of the nodes does not grow, and a node that leaks is found."""

import os
from pathlib import Path
import random
import re
import signal
import subprocess
import sys

import pytest
from waiting import DEADLINE, wait_until

from tools import soak

STEPS, AFTER = 30_000, 10_000  # a million, and 50,000, by hand: `scripts/soak`
COMMAND = (sys.executable, '-m', 'tools.soak')


def readings_of(mb):
    """Return readings of mb(steps) every 2,000 steps up to a million."""
    return [(steps, mb(steps)) for steps in range(0, 1_000_001, 2_000)]


def noisy(steps, leak=0.0):
    """Return the MB of a node that leaks so much a step and sometimes writes a snapshot."""
    caches = 60.0 + 20.0 * min(1.0, steps / 30_000)
    snapshot = 30.0 if steps % 50_000 == 0 else 0.0
    return caches + snapshot + leak * steps + random.Random(steps).uniform(-0.3, 0.3)


@pytest.mark.usefixtures('domain')
@pytest.mark.long
def test_no_node_grows_while_it_learns_with_a_state_dir(tmp_path, monkeypatch):
    monkeypatch.delenv('ROS_PYTHON_CHECK_FIELDS')
    done = subprocess.run(
        [*COMMAND, '--mentor', 'noisy:0.3', '--steps', str(STEPS), '--after', str(AFTER), '--out',
         str(tmp_path)], capture_output=True, text=True, timeout=DEADLINE, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith('Passed: no node grew by 5 MB.\n')
    rows = dict(re.findall(r'(?m)^(grid_world|mentor|learner) .* ([+-][\d.]+) *$', done.stdout))
    assert set(rows) == {'grid_world', 'mentor', 'learner'}
    assert all(float(growth) < 5.0 for growth in rows.values())
    journals = {path.name.split('.')[1] for path in (tmp_path / 'state').glob('*.journal')}
    assert journals == {'grid_world', 'learner'}  # this mentor has no budget, so no state


def test_caches_snapshots_and_noise_do_not_count_as_growth():
    first, last = soak.memory_at_ends(readings_of(noisy), 50_000)
    assert abs(first - 80.0) < 0.3 and abs(last - first) < 0.3


def test_a_leak_of_six_bytes_a_step_is_found_and_of_four_is_not(capsys):
    def table(leak):
        return {'grid_world': readings_of(noisy),
                'learner': readings_of(lambda steps: noisy(steps, leak * 1e-6))}
    assert soak.show_growth(table(4), 50_000) == 0
    assert 'Passed: no node grew by 5 MB.' in capsys.readouterr().out
    assert soak.show_growth(table(6), 50_000) == 1
    output = capsys.readouterr().out
    assert re.search(r'learner must grow by less than 5 MB, and grew by 5\.\d', output)
    assert 'grid_world must' not in output


def test_a_window_without_a_reading_is_an_error():
    with pytest.raises(soak.SoakFailed, match='between 50,000 and 60,000 steps, got 2 readings'):
        soak.memory_at_ends([(49_000, 60.0), (70_000, 60.0)], 50_000)
    with pytest.raises(soak.SoakFailed, match='got 0 readings up to 0'):
        soak.memory_at_ends([], 50_000)


def test_memory_is_what_the_process_holds():
    before = soak.process_memory(os.getpid())
    block = bytearray(b'x' * 40_000_000)
    assert 39.0 < soak.process_memory(os.getpid()) - before < 42.0
    assert len(block) == 40_000_000


@pytest.mark.usefixtures('domain')
def test_ctrl_c_ends_a_soak_and_its_nodes(tmp_path):
    process = subprocess.Popen([*COMMAND, '--map', 'bar_grid', '--out', str(tmp_path)],
                               stderr=subprocess.PIPE, text=True, start_new_session=True)
    logs = [tmp_path / f'{name}.log' for name in ('grid_world', 'mentor', 'learner')]

    def are_ready():
        assert process.poll() is None, process.communicate()[1]
        return all(log.exists() and 'ready' in log.read_text() for log in logs)
    wait_until(are_ready, 'nodes')
    ids = Path(f'/proc/{process.pid}/task/{process.pid}/children').read_text().split()
    process.send_signal(signal.SIGINT)
    output = process.communicate(timeout=DEADLINE)[1]
    assert process.returncode == 130
    assert output.endswith('soak: interrupted\n') and 'Traceback' not in output
    assert len(ids) == 3 and not any(os.path.exists(f'/proc/{pid}') for pid in ids)


@pytest.mark.parametrize('argv, message', [
    (('--steps', '60000'), 'soak: steps must be at least 20,000 more than after, and after at '
                           'least 0, got 60,000 and 50,000'),
    (('--after', '-1'), 'soak: steps must be at least 20,000 more than after'),
    (('--iterations', '3'), 'soak: a soak ends after --steps: iterations must not be given'),
    (('--map', 'nowhere'), "soak: map 'nowhere': a map must be one of"),
])
def test_a_mistake_is_reported_before_anything_is_started(tmp_path, capsys, argv, message):
    assert soak.main(['soak', *argv, '--out', str(tmp_path)]) == 2
    output = capsys.readouterr().err
    assert output.startswith(message) and output.count('\n') == 1
    assert not (tmp_path / 'learner.log').exists()
