# SPDX-License-Identifier: Apache-2.0
"""Loops over topics in processes of their own: started, measured for a while, and ended."""

from contextlib import contextmanager
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import yaml

import comply_ros
from tools.benchmarks.step_times import BEGUN, pace, STAMPS

TOP = Path(comply_ros.__file__).parents[1]
DEADLINE, PATIENCE, LOOK = 120.0, 10.0, 0.005  # seconds: to begin, to end, between two looks
RING = [['ring', 'world'], ['ring', 'mentor'], ['ring', 'learner']]
NODES = 'grid_world', 'mentor', 'learner'


class BenchmarkError(RuntimeError):
    """A measuring that cannot be; the message says why, with what was printed last."""


def real(*variants):
    """Return who takes part in a loop of the three nodes, each in a process, in a variant."""
    return [['real', name, *variants] for name in NODES]


def together(*variants):
    """Return who takes part in a loop of the three nodes in one process."""
    return [['real', '+'.join(NODES), *variants]]


def nodes_file(folder, world=(), mentor=(), learner=()):
    """Write the parameters of the three nodes of a measuring; return the path of the file."""
    tables = zip(NODES, (
        {'map': 'maze', **dict(world)}, {'mentor': 'noisy:0.3', **dict(mentor)},
        {'method': 'beta_implicit', 'measuring_iterations': 0, 'iterations': 0, **dict(learner)}))
    path = folder / 'parameters.yaml'
    path.write_text(yaml.safe_dump({f'/**/{name}': {'ros__parameters': table}
                                    for name, table in tables}))
    return path


@contextmanager
def running(folder, members, parameters=None):
    """Run members as processes that end with the block, the one that leads the loop first."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    arguments = ['--ros-args', '-r', f'__ns:=/benchmark_{os.getpid()}']
    if parameters:
        arguments += ['--params-file', str(parameters)]
    started = []
    try:
        for number, (module, *words) in enumerate(members):
            started.append(_start(folder, f'{number}.log', [
                f'comply_ros.benchmarks.{module}', str(os.getpid()), str(folder),
                ','.join(words), *arguments]))
        yield started
    finally:
        for process in started:
            end(process)


def _start(folder, log, words):
    with (folder / log).open('wb') as output:
        return subprocess.Popen(
            [sys.executable, '-m', *words], stdout=output, stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL, start_new_session=True,
            env={**os.environ, 'PYTHONPATH': f'{TOP}:{os.environ.get("PYTHONPATH", "")}'})


def end(process):
    """Interrupt a process and wait for its end; one that does not end in time is killed."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def wait_until(condition, what, alive=lambda: None):
    """
    Return as soon as a condition holds; alive is called meanwhile, and may raise.

    Raises
    ------
    BenchmarkError: after the deadline.

    """
    deadline = time.monotonic() + DEADLINE
    while not condition():
        alive()
        if time.monotonic() > deadline:
            raise BenchmarkError(f'{what} must come within {DEADLINE:.0f} s, and did not')
        time.sleep(LOOK)


def warm(folder, processes):
    """
    Return when the loop is warm.

    Raises
    ------
    BenchmarkError: if one of the processes ends before.

    """
    def alive():
        for number, process in enumerate(processes):
            if process.poll() is not None:
                msg = (folder / f'{number}.log').read_text(errors='replace')
                raise BenchmarkError(f'process {number} of the loop ended with '
                                     f'{process.returncode}: {msg[-1500:]}')
    wait_until((folder / BEGUN).exists, 'a loop over topics', alive)


def measure(folder, members, seconds, parameters=None):
    """Return the `Pace` of a loop, measured for so many seconds from when it is warm."""
    with running(folder, members, parameters) as processes:
        warm(folder, processes)
        time.sleep(seconds)  # what is measured is how much happens meanwhile
    return pace(np.fromfile(folder / STAMPS, dtype=np.int64))
