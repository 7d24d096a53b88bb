# SPDX-License-Identifier: Apache-2.0
"""The command `check` on live nodes: ours pass every rule, the examples every MUST."""

import xml.etree.ElementTree as ElementTree

from example_nodes import example, EXAMPLES
from node_processes import nodes, run
import pytest

pytestmark = pytest.mark.usefixtures('domain')
OWN = {'world': 'own_world', 'mentor': 'own_mentor', 'learner': 'own_learner'}


@pytest.mark.parametrize('kind, name, arguments', [
    ('mentor', 'mentor', ('-p', 'mentor:=noisy:0.3')),
    pytest.param('world', 'grid_world', ('-p', 'map:=bar_grid'), marks=pytest.mark.long),
    pytest.param('world', 'gym_world', ('-p', 'env:=FrozenLake-v1'), marks=pytest.mark.long),
    pytest.param('learner', 'learner', (), marks=pytest.mark.long)])
def test_our_nodes_pass_every_rule(tmp_path, kind, name, arguments):
    with nodes(tmp_path, **{name: arguments}):
        done = run('check', kind, '--junit', str(tmp_path / 'check.xml'))
    assert (done.returncode, done.stderr) == (0, ''), done.stdout
    assert done.stdout.splitlines()[-1].endswith(' passed, 0 failed, 0 not reached')
    suite = ElementTree.parse(tmp_path / 'check.xml').getroot()
    assert int(suite.get('tests')) == len(suite) >= 10 and suite.get('failures') == '0'


@pytest.mark.long
@pytest.mark.parametrize('kind', OWN)
def test_the_examples_break_no_must(kind):
    with example(OWN[kind]):
        done = run('check', kind, '--name', f'/{OWN[kind]}')
    assert (done.returncode, done.stderr) == (0, ''), done.stdout


@pytest.mark.parametrize('name', OWN.values())
def test_an_example_has_less_than_60_lines_of_code_and_needs_only_rclpy_and_the_messages(name):
    lines = [line for line in (EXAMPLES / f'{name}.py').read_text().splitlines()
             if line and not line.lstrip().startswith(('#', '"""'))]
    assert len(lines) < 60
    imported = {line.split()[1].split('.')[0] for line in lines
                if line.startswith(('import ', 'from '))}
    assert imported <= {'collections', 'comply_msgs', 'contextlib', 'random', 'rclpy', 'time'}


@pytest.mark.long
def test_without_a_node_it_says_so_and_which_there_are():
    done = run('check', 'learner')
    assert (done.returncode, done.stderr) == (2, (
        'check: a learner must be the only publisher on the topic action, got none within 10 s\n'))


def test_an_unknown_rule_is_one_sentence():
    done = run('check', 'mentor', '--only', 'M99')
    assert done.returncode == 2
    assert 'argument --only must be of P1, P12, P3' in done.stderr and "got 'M99'" in done.stderr
