# SPDX-License-Identifier: Apache-2.0
"""A second mentor beside that of a lesson is told, and no word is said about equal bits."""

import json
import subprocess
import sys

from node_processes import log_has, nodes, run
import pytest
from waiting import DEADLINE, wait_until

from comply_ros.nodes.lesson import OTHER_MENTORS
from comply_ros.nodes.node_processes import START

pytestmark = pytest.mark.usefixtures('domain')

SMALL = ('--map', 'bar_grid', '--mentor', 'optimal', '--episodes', '5')
SAME_BITS = 'the same options give the same bits'
HUMAN = ('-p', 'port:=0', '-p', 'teach:=true')


@pytest.mark.parametrize('respawn', [(), ('--respawn',)])
@pytest.mark.parametrize('name, arguments', [('mentor', ('-p', 'mentor:=random')),
                                             ('dashboard', HUMAN)])
def test_a_lesson_says_that_another_mentor_speaks(tmp_path, name, arguments, respawn):
    folder = tmp_path / 'lesson'
    lesson = subprocess.Popen(
        [sys.executable, '-c', START.format('lesson'), *SMALL, '--iterations', '40',
         '--rate', '300', '--out', str(folder), *respawn],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        log = folder / 'learner.log'
        wait_until(lambda: log.exists() and 'starts to learn' in log.read_text(), 'learner')
        with nodes(tmp_path / 'other', **{name: arguments}) as others:
            wait_until(log_has(others[name], 'ready'), 'another mentor')
            output = ' '.join(lesson.communicate(timeout=DEADLINE)[0].split())
    finally:
        lesson.kill()
        lesson.wait()
    assert lesson.returncode == 0
    assert OTHER_MENTORS in output
    assert SAME_BITS not in output and '100.0% optimal' in output
    summary = json.loads((folder / 'summary.json').read_text())
    assert summary['other_mentors'] == 1
    assert set((folder / 'mentor.txt').read_text()) & set('<>^v')


def test_a_lesson_of_its_own_gives_the_same_bits(tmp_path):
    done = run('lesson', *SMALL, '--iterations', '2', '--out', str(tmp_path))
    assert SAME_BITS in ' '.join((done.stdout + done.stderr).split())
    assert json.loads((tmp_path / 'summary.json').read_text())['other_mentors'] == 0
