# SPDX-License-Identifier: Apache-2.0
"""`scripts/chaos`: kills at random moments."""

import os
import re
import subprocess
import sys

import pytest
from waiting import DEADLINE

from tools import chaos

KILLS = os.environ.get('CHAOS_KILLS', '10')
pytestmark = pytest.mark.usefixtures('domain')


@pytest.mark.long
def test_the_digest_is_the_same_however_often_and_whenever_nodes_are_killed(tmp_path):
    done = subprocess.run(
        [sys.executable, '-m', 'tools.chaos', '--kills', KILLS, '--seed', '4',
         '--out', str(tmp_path)], capture_output=True, text=True, check=False,
        timeout=3 * DEADLINE)
    assert done.returncode == 0, done.stderr
    total, world, mentor, learner, equal, lessons = map(int, re.search(
        r'(\d+) kills \(grid_world (\d+), mentor (\d+), learner (\d+)\): the digest was equal in '
        r'(\d+) of (\d+) lessons', ' '.join(done.stdout.split())).groups())
    assert equal == lessons > 1
    assert total == world + mentor + learner == int(KILLS)
    assert min(world, mentor, learner) > 0
    assert done.stderr.count('kill -9') == total


@pytest.mark.long
def test_a_digest_that_differs_is_reported(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(chaos, 'digest_in_process', lambda options: 'f' * 64)
    monkeypatch.setattr(chaos, 'LESSONS', chaos.LESSONS[-1:])
    assert chaos.main(['chaos', '--kills', '1', '--out', str(tmp_path)]) == 1
    output = ' '.join(capsys.readouterr().out.split())
    assert ': must be ffffffffffffffff' in output
    assert 'the digest was equal in 0 of 1 lessons' in output


def test_a_wrong_number_is_one_line(capsys):
    assert chaos.main(['chaos', '--kills', '0']) == 2
    assert capsys.readouterr().err == (
        'chaos: seed must lie in [0, 9007199254740992] and kills be at least 1, got 0 and 0\n')
