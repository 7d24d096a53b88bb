# SPDX-License-Identifier: Apache-2.0
"""The scripts: what they say where something is missing, and when they hand over to `ros2`."""

import os
from pathlib import Path
import shutil
import subprocess

import pytest
from test_package import EXECUTABLES

TOP = Path(__file__).parents[1]


def script(command, folder=TOP, **environment):
    """Run a script in a clean environment; return it with `returncode`, `stdout`, `stderr`."""
    inherited = {key: value for key, value in os.environ.items()
                 if key in ('PATH', 'HOME', 'LANG', 'ROS_DISTRO', 'AMENT_PREFIX_PATH')}
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False,
                          timeout=60, env={**inherited, **environment})


@pytest.fixture
def fresh(tmp_path):
    """Return a folder with the scripts of a clone that was never set up."""
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


def test_an_unsupported_python_is_one_sentence_with_the_remedy(fresh):
    old = tool(fresh / 'bin', 'old', '[ "$1" = --version ] && echo Python 3.9.18; exit 1')
    done = script(['scripts/demo'], fresh, PYTHON=old, ROS_DISTRO='', AMENT_PREFIX_PATH='')
    assert done.returncode == 2
    assert done.stderr == (
        'comply_ros: needs Python 3.11, 3.12 or 3.13, and '
        f'{old} is Python 3.9.18: install one, or name it: PYTHON=/path/to/python3.12 '
        'scripts/demo\n')
    assert not (fresh / '.venv').exists()


def test_a_missing_compiler_is_one_sentence_with_the_remedy(fresh):
    for name in ('bash', 'dirname', 'cat', 'sha256sum', 'cut', 'head', 'flock', 'python3'):
        (fresh / 'bin').mkdir(exist_ok=True)
        (fresh / 'bin' / name).symlink_to(shutil.which(name))
    done = script(['bash', 'scripts/demo'], fresh, PATH=str(fresh / 'bin'),
                  PYTHON=shutil.which('python3'), ROS_DISTRO='', AMENT_PREFIX_PATH='')
    assert done.returncode == 2
    assert done.stderr == (
        'comply_ros: needs a C++ compiler, make and CMake to build its messages, and '
        "'cmake' is missing: sudo apt install build-essential cmake\n")
    assert not (fresh / '.venv').exists()


def test_an_old_ros_is_one_sentence_with_the_remedy(fresh):
    done = script(['scripts/demo'], fresh, ROS_DISTRO='humble', AMENT_PREFIX_PATH='/opt/ros')
    assert done.returncode == 2
    assert done.stderr == (
        'comply_ros: needs ROS 2 Jazzy or newer, and humble is sourced: source a newer one, or '
        'start a shell without it (then ROS 2 comes from Python wheels).\n')


def test_a_folder_with_a_space_is_one_sentence(fresh):
    (fresh / 'my clone').mkdir()
    (fresh / 'scripts').rename(fresh / 'my clone' / 'scripts')
    done = script(['scripts/demo'], fresh / 'my clone')
    assert done.returncode == 2
    assert done.stderr == ('comply_ros: needs a folder without spaces in its path, which colcon '
                           f"cannot build in, got '{fresh / 'my clone'}'\n")


def test_run_names_what_there_is():
    for argv in (['scripts/run'], ['scripts/run', 'nothing']):
        done = script(argv)
        assert done.returncode == 2
        assert ' '.join(sorted(EXECUTABLES)) in done.stderr


def test_scripts_work_from_any_folder(tmp_path):
    done = script([str(TOP / 'scripts' / 'run'), 'train', '--help'], tmp_path)
    assert done.returncode == 0
    assert '--mentor SPEC' in done.stdout


@pytest.mark.parametrize('argv, handed', [
    (['scripts/topic', 'echo', '--once', '/world'], 'topic echo --once /world'),
    (['scripts/param', 'set', '/learner', 'confidence', '0.9'],
     'param set /learner confidence 0.9'),
    (['scripts/service', 'call', '/recommend', 'comply_msgs/srv/Recommend', '{state: 5}'],
     'service call /recommend comply_msgs/srv/Recommend {state: 5}'),
    (['scripts/run', 'learner', '--ros-args', '-p', 'seed:=1'],
     'run comply_ros learner --ros-args -p seed:=1')])
def test_scripts_hand_over_to_ros2_where_it_exists(tmp_path, argv, handed):
    tool(tmp_path, 'ros2', 'echo "$@"')
    done = script(argv, PATH=f'{os.environ["PATH"]}:{tmp_path}')
    assert done.stdout == handed + '\n'
