# SPDX-License-Identifier: Apache-2.0
"""Cores that a process may use, by its affinity and by its cgroups."""

import os
from pathlib import Path
import subprocess
import sys

import pytest

from comply_ros.experiments import available_cores as module
from comply_ros.experiments.available_cores import available_cores
from comply_ros.experiments.parallel_runs import local_executor
from comply_ros.terminal.interrupts import StopFlag

PRINT = 'from comply_ros.experiments.available_cores import available_cores as f; print(f())'


def written(root, files):
    """Write files below a folder, and return the folder."""
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root


@pytest.fixture
def many_cores(monkeypatch):
    """Give this process an affinity of 16 cores, which few machines have."""
    monkeypatch.setattr(os, 'sched_getaffinity', lambda pid: set(range(16)))


@pytest.mark.usefixtures('many_cores')
@pytest.mark.parametrize('files, cores', [
    ({}, 16),
    ({'proc/self/cgroup': '0::/\n', 'sys/fs/cgroup/cpu.max': '400000 100000\n'}, 4),
    ({'proc/self/cgroup': '0::/\n', 'sys/fs/cgroup/cpu.max': 'max 100000\n'}, 16),
    ({'proc/self/cgroup': '0::/a/b\n', 'sys/fs/cgroup/a/cpu.max': '150000 100000\n',
      'sys/fs/cgroup/a/b/cpu.max': 'max 100000\n'}, 2),
    ({'proc/self/cgroup': '0::/\n', 'sys/fs/cgroup/cpu.max': '20000 100000\n'}, 1),
    ({'proc/self/cgroup': '5:memory:/m\n3:cpu,cpuacct:/docker/x\n',
      'sys/fs/cgroup/cpu/cpu.cfs_quota_us': '300000\n',
      'sys/fs/cgroup/cpu/cpu.cfs_period_us': '100000\n'}, 3),
    ({'proc/self/cgroup': '3:cpu,cpuacct:/\n', 'sys/fs/cgroup/cpu/cpu.cfs_quota_us': '-1\n',
      'sys/fs/cgroup/cpu/cpu.cfs_period_us': '100000\n'}, 16)],
    ids=['none', 'v2', 'v2 without a limit', 'v2, limit of a parent', 'less than a core',
         'v1 in a container', 'v1 without a limit'])
def test_the_smallest_quota_of_the_cgroups_counts(tmp_path, files, cores):
    assert available_cores(written(tmp_path, files)) == cores


def test_the_affinity_counts():
    core = min(os.sched_getaffinity(0))
    done = subprocess.run(['taskset', '--cpu-list', str(core), sys.executable, '-c', PRINT],
                          capture_output=True, text=True, check=True)
    assert done.stdout == '1\n'


def test_as_many_runs_at_once_as_there_are_available_cores():
    with local_executor(lambda job, stop: job, StopFlag()) as executor:
        assert executor.label == f'{available_cores()} at once'


def test_no_other_count_of_cores_is_in_use():
    root = Path(module.__file__).parents[2]
    assert [path.name for folder in ('comply_ros', 'tools') for path in root.glob(
        f'{folder}/**/*.py') if 'cpu_count' in path.read_text()] == []
