# SPDX-License-Identifier: Apache-2.0
"""The launch file under the genuine `ros2 launch`: it ends by itself, and tells of failures."""

from importlib.util import find_spec
import os
from pathlib import Path
import signal
import subprocess
import sys

from node_processes import ROOT
import pytest
from waiting import DEADLINE, wait_until

import comply_ros

FILE = str(ROOT / 'launch' / 'teach.launch.py')
COMMAND = (sys.executable, '-c',
           'import sys; from ros2cli.cli import main; sys.argv[0] = "ros2"; sys.exit(main())')
MAP = """{intended: 0.9, step_limit: 40, rewards: {step: -1, goal: 9}, starts: anywhere,
rows: [..G]}"""

pytestmark = [
    pytest.mark.usefixtures('domain'),
    pytest.mark.skipif(any(find_spec(name) is None for name in ('launch_ros', 'ros2launch')),
                       reason='launch_ros and ros2launch are not installed: ROS brings them')]


def launched(*arguments, folder):
    """Run `ros2 launch` with the launch file in a folder, to its end."""
    process = subprocess.Popen(
        [*COMMAND, 'launch', FILE, *arguments], cwd=folder, text=True, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, env={**os.environ, 'ROS_LOG_DIR': str(folder / 'log')})
    try:
        output, errors = process.communicate(timeout=DEADLINE)
    finally:  # with its nodes: they would be heard by later tests
        process.send_signal(signal.SIGINT)
        process.communicate()
    return subprocess.CompletedProcess(process.args, process.returncode, output, errors)


def children(process):
    """Return the process ids of the nodes that a launch has started, by name."""
    ids = Path(f'/proc/{process.pid}/task/{process.pid}/children').read_text().split()
    return {name: int(pid) for pid in ids for name in ('grid_world', 'mentor', 'learner')
            if f'/comply_ros/{name}\0' in Path(f'/proc/{pid}/cmdline').read_text()}


@pytest.mark.parametrize('more', [(), ('respawn:=true',)])
def test_it_ends_by_itself_when_the_learner_has_finished(tmp_path, more):
    done = launched('map:=bar_grid', 'mentor:=optimal', 'iterations:=1', *more, folder=tmp_path)
    assert 'finished 1 iterations, digest' in done.stdout
    assert '\x1b' not in done.stdout  # colors are for terminals
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_misspelt_argument_is_named_and_one_of_another_launch_file_is_not(tmp_path):
    done = launched('mentr:=none', 'robot_name:=r2', 'anna.advice_timeout:=9', 'map:=bar_grid',
                    'bob.advice_timeot:=9', 'mentor:=optimal', 'iterations:=1', folder=tmp_path)
    log = done.stdout + done.stderr
    assert "'bob.advice_timeot' is unknown and has no effect; did you mean " \
        "'bob.advice_timeout'?" in log
    assert "argument 'mentr' is unknown and has no effect; did you mean 'mentor'?" in log
    assert log.count('is unknown') == 2
    assert done.returncode == 0, log


@pytest.mark.parametrize('wrong, sentence', [
    ('map:=nowhere', "map 'nowhere': a map must be one of"), ('mentor:=wise', 'a mentor must be'),
    ('seed:=x', 'parameter seed must be an integer'),
    ('anna.advice_timeout:=-1', 'parameter anna.advice_timeout must lie in [0, 3600], got -1')])
@pytest.mark.parametrize('more', [(), ('respawn:=true',)])
def test_a_node_that_refuses_a_parameter_fails_the_launch(tmp_path, wrong, sentence, more):
    done = launched(wrong, *more, folder=tmp_path)
    assert sentence in done.stdout
    assert 'ended with exit code 2' in done.stdout + done.stderr
    assert done.returncode == 1


@pytest.mark.parametrize('name, wrong', [
    ('record', 'bag: 7'), ('dashboard', 'port: -1'), ('viewer', 'cell_size: -1.0')])
def test_one_that_only_watches_and_refuses_a_parameter_fails_it_too(tmp_path, name, wrong):
    file = tmp_path / 'wrong.yaml'
    file.write_text(f'/**/{name}:\n  ros__parameters:\n    {wrong}\n')
    done = launched(f'params_file:={file}', 'map:=bar_grid', 'mentor:=none', 'iterations:=0',
                    f'{name}:=true', folder=tmp_path)
    assert f'{name} ended with exit code 2' in done.stdout + done.stderr
    assert done.returncode == 1


@pytest.mark.parametrize('name', ['grid_world', 'mentor', 'learner'])
def test_a_node_that_is_killed_fails_the_launch(tmp_path, name):
    process = subprocess.Popen(
        [*COMMAND, 'launch', FILE, 'map:=bar_grid', 'mentor:=optimal', 'iterations:=0'],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env={**os.environ, 'ROS_LOG_DIR': str(tmp_path)})
    try:
        wait_until(lambda: len(children(process)) == 3, 'three nodes')
        os.kill(children(process)[name], signal.SIGKILL)
        output = process.communicate(timeout=DEADLINE)[0]
    finally:
        process.terminate()
        process.wait()
    assert f'{name} ended with exit code -9' in output
    assert process.returncode == 1


@pytest.mark.parametrize('name', ['1e3', 'maze #2.yaml', '010'])
def test_a_map_is_the_one_of_the_name_that_was_given(tmp_path, name):
    (tmp_path / name).write_text(MAP)
    done = launched(f'map:={name}', 'mentor:=none', 'method:=sarsa', 'iterations:=1',
                    folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert 'finished 1 iterations' in done.stdout


def test_each_robot_learns_the_bits_of_train_by_its_seed_with_the_same_mentors(tmp_path):
    mentors = 'optimal noisy:0.6 on=random'  # a name that YAML would take for a boolean
    done = launched('map:=bar_grid', f'mentors:={mentors}', 'iterations:=2', 'seed:=3',
                    'robots:=2', folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    for robot, seed in (('robot_1', 3), ('robot_2', 4)):
        result = comply_ros.train('bar_grid', mentor=mentors.split(), seed=seed, iterations=2)
        assert f'[{robot}.learner]: finished 2 iterations, digest {result.digest}' in done.stdout
        assert f'[{robot}.mentor_on]: advises in world' in done.stdout


@pytest.mark.parametrize('arguments, sentence', [
    (('mentor:=optimal', 'mentors:=random'),
     "either mentor or mentors must be given, got 'optimal' and 'random'"),
    (('mentors:=anna=optimal anna=random',),
     "each mentor must have a name of its own, got 'anna' twice"),
    (('method:=beta_implict',), "did you mean 'beta_implicit'? a method must be one of sarsa, "),
    (('profile:=new',), "a profile must be one of report, published, got 'new'"),
    (('robots:=0',), 'robots must lie in [1, 64], got 0'),
    (('robots:=some',), "robots must be a whole number, got 'some'"),
    (('robots:=2', 'seed:=-1'), "seed must be a whole number, got '-1'"),
    (('robots:=2', 'record:=true'), 'record:=true must be used with one robot, got robots:=2')])
def test_robots_and_mentors_that_cannot_be_fail_the_launch_in_one_sentence(
        tmp_path, arguments, sentence):
    done = launched(*arguments, folder=tmp_path)
    assert sentence in done.stdout + done.stderr
    assert done.returncode == 1


def test_the_person_on_the_page_has_a_name_beside_mentors_that_have_one(tmp_path):
    done = launched('map:=bar_grid', 'mentors:=person=optimal anna=random', 'iterations:=20',
                    'rate:=400.0', 'dashboard:=true', 'teach:=true', folder=tmp_path)
    assert '[learner]: takes the advice of person_2 too' in done.stdout, done.stdout + done.stderr
