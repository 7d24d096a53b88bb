# SPDX-License-Identifier: Apache-2.0
"""The scripts: their errors, what a second start needs, and when they call `ros2`."""

import os
from pathlib import Path
import shutil
import subprocess

import pytest
from waiting import DEADLINE

from comply_ros.executables import EXECUTABLES

TOP = Path(__file__).parents[2]


def script(command, folder=TOP, **environment):
    """Run a script in a clean environment; return it with `returncode`, `stdout`, `stderr`."""
    inherited = {key: value for key, value in os.environ.items()
                 if key in ('PATH', 'HOME', 'LANG', 'ROS_DISTRO', 'AMENT_PREFIX_PATH')}
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False,
                          timeout=DEADLINE, env={**inherited, **environment})


@pytest.fixture
def fresh(tmp_path):
    """Return a folder with the scripts of a clone that is not set up."""
    shutil.copytree(TOP / 'scripts', tmp_path / 'scripts')
    shutil.copytree(TOP / 'requirements', tmp_path / 'requirements')
    return tmp_path


def tool(folder, name, text):
    """Write an executable shell script."""
    folder.mkdir(exist_ok=True)
    path = folder / name
    path.write_text(f'#!/bin/sh\n{text}\n')
    path.chmod(0o755)
    return str(path)


def programs(folder, *names):
    """Return a PATH on which there are only these programs."""
    folder.mkdir()
    for name in names:
        (folder / name).symlink_to(shutil.which(name))
    return str(folder)


def test_an_unsupported_python_is_one_line_with_the_remedy(fresh):
    old = tool(fresh / 'bin', 'old', '[ "$1" = --version ] && echo Python 3.9.18; exit 1')
    done = script(['scripts/demo'], fresh, PYTHON=old, ROS_DISTRO='', AMENT_PREFIX_PATH='')
    assert done.returncode == 2
    assert done.stderr == (
        'comply_ros: needs Python 3.11, 3.12 or 3.13, and '
        f'{old} is Python 3.9.18: install one, or name it: PYTHON=/path/to/python3.12 '
        'scripts/demo\n')
    assert not (fresh / '.venv').exists()


def test_a_missing_compiler_is_one_line_with_the_remedy(fresh):
    path = programs(fresh / 'bin', 'bash', 'dirname', 'env', 'find', 'flock', 'python3',
                    'readlink')
    done = script(['bash', 'scripts/demo'], fresh, PATH=path,
                  PYTHON=shutil.which('python3'), ROS_DISTRO='', AMENT_PREFIX_PATH='')
    assert done.returncode == 2
    assert done.stderr == (
        'comply_ros: needs a C++ compiler, make and CMake to build its messages, and '
        "'cmake' is missing: sudo apt install build-essential cmake\n")
    assert not (fresh / '.venv').exists()


def test_an_old_ros_is_one_line_with_the_remedy(fresh):
    prefix = fresh.with_name(f'{fresh.name}-ros')
    packages = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages'
    packages.mkdir(parents=True)
    (packages / 'rclpy').touch()
    done = script(['scripts/demo'], fresh, ROS_DISTRO='humble', AMENT_PREFIX_PATH=str(prefix))
    assert done.returncode == 2
    assert done.stderr == (
        'comply_ros: needs ROS 2 Jazzy or newer, and humble is sourced: source a newer one, or '
        'start a shell without it (then ROS 2 comes from Python wheels).\n')


def test_a_folder_with_a_space_is_one_line(fresh):
    (fresh / 'my clone').mkdir()
    (fresh / 'scripts').rename(fresh / 'my clone' / 'scripts')
    done = script(['scripts/demo'], fresh / 'my clone')
    assert done.returncode == 2
    assert done.stderr == (
        'comply_ros: needs a folder whose path has only the letters a to z, digits and ._-+@~ '
        f"(colcon and CMake cannot build in others), got '{fresh / 'my clone'}'\n")


def test_run_names_the_executables():
    for argv in (['scripts/run'], ['scripts/run', 'nothing']):
        done = script(argv)
        assert done.returncode == 2
        assert ' '.join(sorted(EXECUTABLES)) in done.stderr


@pytest.mark.parametrize('argv, output', [
    (['run', 'train'], '--mentor SPEC'), (['topic'], 'echo'), (['service'], 'call'),
    (['param'], 'describe'), (['chaos'], '--kills N'), (['soak'], '--steps N'),
    (['benchmark'], '--rounds N')])
def test_scripts_work_from_any_folder(tmp_path, argv, output):
    name, *arguments = argv
    done = script([str(TOP / 'scripts' / name), *arguments, '--help'], tmp_path)
    assert done.returncode == 0, done.stderr
    assert output in done.stdout


@pytest.mark.parametrize('argv, words', [
    (['topic'], '{list,info,echo,hz}'), (['service'], '{list,type,call}'),
    (['param'], '{list,get,set,describe}'), (['run', 'check'], '{world,mentor,learner}')])
def test_a_missing_word_is_named_by_what_it_can_be(argv, words):
    done = script([f'scripts/{argv[0]}', *argv[1:]])
    assert done.returncode == 2
    assert done.stderr.endswith(f': the following arguments are required: {words}; --help shows '
                                'what there is\n')


def test_an_installed_executable_finds_its_entry_point(tmp_path):
    installed = TOP / 'install' / 'comply_ros' / 'lib' / 'comply_ros' / 'train'
    done = script([str(TOP / 'scripts' / 'python'), str(installed), '--help'], tmp_path)
    assert done.returncode == 0, done.stderr
    assert '--mentor SPEC' in done.stdout


def test_a_second_start_runs_few_programs(tmp_path):
    path = programs(tmp_path / 'bin', 'bash', 'dirname', 'find', 'flock', 'readlink')
    done = script(['bash', 'scripts/python', '-c', 'import comply_msgs, comply_ros'], PATH=path)
    assert (done.returncode, done.stdout, done.stderr) == (0, '', '')


def test_a_script_that_is_started_by_another_has_the_same_environment():
    show = ('import os; print(sorted((name, value) for name, value in os.environ.items()'
            ' if name.endswith("PATH") or name == "VIRTUAL_ENV"))')
    nested = 'import subprocess, sys; subprocess.run(sys.argv[1:], check=True)'
    alone = script(['scripts/python', '-c', show])
    inner = script(['scripts/python', '-c', nested, 'scripts/python', '-c', show])
    assert inner.returncode == 0, inner.stderr
    assert inner.stdout == alone.stdout
    assert 'LD_LIBRARY_PATH' in alone.stdout and 'PYTHONPATH' in alone.stdout


@pytest.mark.parametrize('argv, command', [
    (['scripts/topic', 'echo', '--once', '/world'], 'topic echo --once /world'),
    (['scripts/param', 'set', '/learner', 'confidence', '0.9'],
     'param set /learner confidence 0.9'),
    (['scripts/service', 'call', '/recommend', 'comply_msgs/srv/Recommend', '{state: 5}'],
     'service call /recommend comply_msgs/srv/Recommend {state: 5}'),
    (['scripts/run', 'learner', '--ros-args', '-p', 'seed:=1'],
     'run comply_ros learner --ros-args -p seed:=1')])
def test_scripts_call_ros2_if_it_is_installed(tmp_path, argv, command):
    tool(tmp_path, 'ros2', 'echo "$@"')
    done = script(argv, PATH=f'{os.environ["PATH"]}:{tmp_path}')
    assert done.stdout == command + '\n'
