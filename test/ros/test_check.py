# SPDX-License-Identifier: Apache-2.0
"""The command `check` on live nodes: ours pass every rule, the examples every MUST."""

from pathlib import Path
import shlex
import signal
import subprocess
import sys
from types import SimpleNamespace
import xml.etree.ElementTree as ElementTree

from check_channels import MachineChannel
from example_nodes import example, EXAMPLES
from node_processes import log_has, nodes, run
import pytest
from waiting import DEADLINE, wait_until

from comply_ros.bags.bag_reader import Bag
from comply_ros.nodes.check import failure_bags
from comply_ros.nodes.check_channel import NoNodeError
from comply_ros.nodes.node_processes import START
from comply_ros.protocol.messages import StateReward
from comply_ros.protocol.rule_report import FAIL, Received, Verdict

pytestmark = pytest.mark.usefixtures('domain')
OWN = {'world': 'own_world', 'mentor': 'own_mentor', 'learner': 'own_learner'}


BROKEN_NODE = Path(__file__).parents[1] / 'support/broken_node.py'


def start(name, *arguments):
    """Return the command that starts one of our nodes, for `--start`."""
    return shlex.join([sys.executable, '-c', START.format(name), '--ros-args', *arguments])


@pytest.mark.parametrize('kind, name, arguments', [
    ('mentor', 'mentor', ('-p', 'mentor:=noisy:0.3', '-p', 'budget:=20')),
    pytest.param('world', 'grid_world', ('-p', 'map:=bar_grid', '-p', 'seed:={seed}'),
                 marks=pytest.mark.long),
    pytest.param('world', 'gym_world', ('-p', 'env:=FrozenLake-v1', '-p', 'seed:={seed}'),
                 marks=pytest.mark.long),
    pytest.param('learner', 'learner', ('-p', 'measuring_iterations:=0'),
                 marks=pytest.mark.long)])
def test_our_nodes_pass_every_rule(tmp_path, kind, name, arguments):
    done = run('check', kind, '--start', start(name, *arguments),
               '--junit', str(tmp_path / 'check.xml'))
    assert (done.returncode, done.stderr) == (0, ''), done.stdout
    assert done.stdout.splitlines()[-1].endswith(' passed, 0 failed, 0 not reached')
    suite = ElementTree.parse(tmp_path / 'check.xml').getroot()
    assert int(suite.get('tests')) == len(suite) >= 10 and suite.get('failures') == '0'


@pytest.mark.long
@pytest.mark.parametrize('kind', OWN)
def test_the_examples_break_no_must(tmp_path, kind):
    with example(OWN[kind]):
        done = run('check', kind, '--name', f'/{OWN[kind]}', '--bags', str(tmp_path / 'bags'),
                   timeout=2 * DEADLINE)
    assert done.returncode == 0, done.stdout


@pytest.mark.long
@pytest.mark.parametrize('rule', ['P1', 'P2', 'P4', 'P12'])
def test_a_node_that_breaks_a_rule_that_only_a_live_one_shows_fails_just_that(tmp_path, rule):
    kind, parameter = ('world', 'map:=bar_grid') if rule == 'P2' else ('mentor', 'budget:=20')
    done = run('check', kind, '--bags', str(tmp_path / 'bags'), '--start', shlex.join([
        sys.executable, str(BROKEN_NODE), rule, '--ros-args', '-p', parameter]))
    failed = [line.split()[1] for line in done.stdout.splitlines() if line.startswith('FAIL')]
    assert failed == [rule], done.stdout
    assert rule != 'P4' or 'got: stamps that are 0' in done.stdout


@pytest.mark.long
def test_a_failure_is_written_as_a_short_bag_whose_name_is_in_the_report(tmp_path):
    with example('own_mentor'):
        done = run('check', 'mentor', '--only', 'M6', '--bags', str(tmp_path / 'bags'),
                   '--junit', str(tmp_path / 'check.xml'))
    assert f'bag: {tmp_path}/bags/M6 (' in ' '.join(done.stdout.split()), done.stdout
    assert [each.topic for each in Bag(tmp_path / 'bags' / 'M6')] == ['/world']
    assert 'bags/M6' in (tmp_path / 'check.xml').read_text()


@pytest.mark.parametrize('name', OWN.values())
def test_an_example_has_less_than_60_lines_of_code_and_needs_only_rclpy_and_the_messages(name):
    lines = [line for line in (EXAMPLES / f'{name}.py').read_text().splitlines()
             if line and not line.lstrip().startswith(('#', '"""'))]
    assert len(lines) < 60
    imported = {line.split()[1].split('.')[0] for line in lines
                if line.startswith(('import ', 'from '))}
    assert imported <= {'collections', 'comply_msgs', 'contextlib', 'random', 'rclpy', 'time'}


@pytest.mark.long
def test_a_node_that_ends_during_the_check_is_named_and_has_not_passed(tmp_path):
    learner = start('learner', '-p', 'iterations:=1', '-p', 'episodes:=1',
                    '-p', 'end_when_finished:=true')
    done = run('check', 'learner', '--start', learner, '--bags', str(tmp_path))
    assert done.returncode == 1, done.stdout
    assert done.stderr.endswith('check: /learner has ended during the check\n')


@pytest.mark.long
def test_without_a_node_it_says_so_and_which_there_are():
    done = run('check', 'learner')
    assert (done.returncode, done.stderr) == (2, (
        'check: a learner must be the only publisher on the topic action, got none within 10 s\n'))


@pytest.mark.long
def test_a_node_that_plays_another_part_ends_the_check(tmp_path):
    with nodes(tmp_path, grid_world=('-p', 'map:=bar_grid'), mentor=()) as running:
        wait_until(log_has(running['grid_world'], 'ready'), 'a world')
        done = run('check', 'mentor')
    assert (done.returncode, done.stderr) == (2, (
        'check: while a mentor is checked, no other node must publish on the topic world, got '
        '/grid_world\n'))


def test_an_unknown_rule_is_one_sentence():
    done = run('check', 'mentor', '--only', 'M99')
    assert done.returncode == 2
    assert 'argument --only must be of P1, P2, P4, P12, P3' in done.stderr
    assert "got 'M99'" in done.stderr


@pytest.mark.parametrize('command, reason', [
    ('no_such_command_here --x', 'no such program'), ('', 'no such program'),
    ('python "', 'No closing quotation')])
def test_a_start_that_cannot_be_run_is_one_sentence(command, reason):
    done = run('check', 'mentor', '--start', command)
    assert (done.returncode, done.stderr) == (2, (
        f'check: --start must be a command that can be run, got {command!r} ({reason})\n'))


@pytest.mark.parametrize('name', ['no_folder/check.xml', ''])
def test_a_file_that_cannot_be_written_is_reported_before_the_check(tmp_path, name):
    done = run('check', 'mentor', '--junit', str(tmp_path / name))
    assert done.returncode == 2 and done.stderr.endswith(
        f'argument --junit: it must be a file that can be written, got {str(tmp_path / name)!r}\n')


def test_what_was_found_stays_where_another_node_comes_while_it_is_shortened(
        tmp_path, capsys):
    class OtherNodeChannel(MachineChannel):
        namespace = '/'

        def send(self, msg):
            raise NoNodeError('no other node must publish')
    failed = Verdict('M6', FAIL, 'a policy', 'none', (), 3, (Received(
        1.0, StateReward(7, 1, 0, 3, 0.0, False, False)),))
    options = SimpleNamespace(kind='mentor', map='bar_grid', seed=0, bags=tmp_path)
    bags = dict(failure_bags(OtherNodeChannel(None), options, [failed]))
    assert str(bags['M6']) == f'{tmp_path}/M6 (1 message)'
    assert 'check: does not shorten it: no other node must' in capsys.readouterr().err


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGKILL])
def test_what_was_started_ends_with_the_check_that_is_interrupted_or_killed(tmp_path, number):
    node = shlex.join(['sh', '-c', f'echo $$ > {tmp_path}/pid; exec sleep 1000'])
    process = subprocess.Popen(
        [sys.executable, '-c', START.format('check'), 'mentor', '--start', node],
        stderr=subprocess.PIPE, text=True)
    pid = int(wait_until(lambda: (tmp_path / 'pid').exists()
                         and (tmp_path / 'pid').read_text(), 'a node'))
    process.send_signal(number)
    errors = process.communicate(timeout=DEADLINE)[1]
    if number == signal.SIGINT:
        assert (process.returncode, errors) == (130, 'check: interrupted\n')
    wait_until(lambda: not has_program(pid), 'end of the node')


def has_program(pid):
    """Tell whether a process still runs; one that has ended and is not waited for has none."""
    try:
        return bool(Path(f'/proc/{pid}/cmdline').read_bytes())
    except FileNotFoundError:
        return False
