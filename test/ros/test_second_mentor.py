# SPDX-License-Identifier: Apache-2.0
"""A second mentor beside that of a lesson is told, and no word is said about equal bits."""

import json
from pathlib import Path
import subprocess
import sys

from node_processes import nodes, run
import pytest
from ros_client import ros_client
from waiting import DEADLINE, wait_until

from comply_ros.nodes.lesson_watch import OTHER_MENTORS
from comply_ros.nodes.node_processes import START

pytestmark = pytest.mark.usefixtures('domain')

SMALL = ('--map', 'bar_grid', '--mentor', 'optimal', '--episodes', '5')
SAME_BITS = 'the same options give the same bits'
HUMAN = ('-p', 'port:=0', '-p', 'teach:=true')


@pytest.mark.parametrize('name, arguments, respawn', [
    ('mentor', ('-p', 'mentor:=random'), ()), ('dashboard', HUMAN, ('--respawn',))])
@pytest.mark.long
def test_a_lesson_says_that_another_mentor_speaks(tmp_path, name, arguments, respawn):
    folder, output = tmp_path / 'lesson', tmp_path / 'output'
    with output.open('w') as file:
        lesson = subprocess.Popen(
            [sys.executable, '-c', START.format('lesson'), *SMALL, '--iterations', '40',
             '--rate', '20', '--out', str(folder), *respawn], stdout=file, stderr=file)
    try:
        log = folder / 'learner.log'
        wait_until(lambda: log.exists() and 'starts to learn' in log.read_text(), 'learner')
        with nodes(tmp_path / 'other', **{name: arguments}), ros_client() as client:
            wait_until(lambda: OTHER_MENTORS in words(output), 'another mentor')
            assert client.set('grid_world', rate=0.0) == ''
            assert lesson.wait(DEADLINE) == 0
    finally:
        lesson.kill()
        lesson.wait()
    assert SAME_BITS not in words(output) and '100.0% optimal' in words(output)
    summary = json.loads((folder / 'summary.json').read_text())
    assert summary['other_mentors'] == 1
    assert set((folder / 'mentor.txt').read_text()) & set('<>^v')


def words(output: Path) -> str:
    """Text of a file, with one space for every line break."""
    return ' '.join(output.read_text(errors='replace').split())


def test_a_lesson_of_its_own_gives_the_same_bits(tmp_path):
    done = run('lesson', *SMALL, '--iterations', '2', '--out', str(tmp_path))
    assert SAME_BITS in ' '.join((done.stdout + done.stderr).split())
    assert json.loads((tmp_path / 'summary.json').read_text())['other_mentors'] == 0
