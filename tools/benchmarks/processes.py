# SPDX-License-Identifier: Apache-2.0
"""Starts the processes of a benchmark, measures them for a while, and ends them."""

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time
from typing import Any

import numpy as np

from comply_ros.nodes.node_processes import yaml_for_rcl
from tools.benchmarks.interleave import BenchmarkError
from tools.benchmarks.step_times import loop_speed, LoopSpeed, TIMES_FILE, WARM_FILE

ROOT = Path(__file__).parents[2]
START_TIMEOUT, END_TIMEOUT, POLL_PERIOD = 120.0, 10.0, 0.005  # seconds
NODES = 'grid_world', 'mentor', 'learner'
# A member of a loop: the module that is run, and what it is given.
Members = Sequence[tuple[str, ...]]
RING: Members = [('empty_ring', 'world'), ('empty_ring', 'mentor'), ('empty_ring', 'learner')]


def three_processes(*variants: str) -> Members:
    """Members of a loop of the three nodes, each in a process."""
    return [('instrumented_nodes', name, *variants) for name in NODES]


def two_processes() -> Members:
    """Members of a loop whose mentor is in a process of another loop."""
    return [('instrumented_nodes', name) for name in NODES if name != 'mentor']


def one_process(*variants: str) -> Members:
    """Members of a loop of the three nodes in one process."""
    return [('instrumented_nodes', '+'.join(NODES), *variants)]


def write_parameters(folder: Path, world: Mapping[str, Any] | None = None,
                     mentor: Mapping[str, Any] | None = None,
                     learner: Mapping[str, Any] | None = None) -> Path:
    """Write a parameter file for the three nodes; return its path."""
    tables = {
        'grid_world': {'map': 'maze', **(world or {})},
        'mentor': {'mentor': 'noisy:0.3', **(mentor or {})},
        'learner': {'method': 'beta_implicit', 'measuring_iterations': 0, 'iterations': 0,
                    **(learner or {})}}
    folder.mkdir(exist_ok=True)
    path = folder / 'parameters.yaml'
    path.write_text(yaml_for_rcl({f'/**/{name}': {'ros__parameters': table}
                                  for name, table in tables.items()}))
    return path


def namespace_of(loop: str) -> str:
    """Return the namespace of one of several loops; '' for the only one."""
    return f'/benchmark_{os.getpid()}/{loop.strip("/")}'.rstrip('/')


@contextmanager
def running(folder: Path, members: Members, parameters: Path | None = None,
            namespace: str = '') -> Generator[list[subprocess.Popen]]:
    """
    Run a loop, the world first; its processes end with the block.

    namespace: of one of several loops, with a slash before it.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    arguments = ['--ros-args', '-r', f'__ns:={namespace_of(namespace)}']
    if parameters:
        arguments += ['--params-file', str(parameters)]
    environment = {**os.environ, 'PYTHONPATH': f'{ROOT}:{os.environ.get("PYTHONPATH", "")}'}
    started: list[subprocess.Popen] = []
    try:
        for number, (module, *selection) in enumerate(members):
            with (folder / f'{number}.log').open('wb') as log:
                started.append(subprocess.Popen(
                    [sys.executable, '-m', f'tools.benchmarks.{module}', str(os.getpid()),
                     str(folder), ','.join(selection), *arguments], stdout=log,
                    stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, start_new_session=True,
                    env=environment))
        yield started
    finally:
        for process in started:
            end(process)


def end(process: subprocess.Popen) -> None:
    """Interrupt a process and wait for its end; kill it if it does not end in time."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        process.wait(END_TIMEOUT)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def wait_until(condition: Callable[[], object], what: str,
               check: Callable[[], object] = lambda: None) -> None:
    """
    Return as soon as a condition holds; `check` is called meanwhile, and may raise.

    Raises
    ------
    BenchmarkError: after `START_TIMEOUT`.

    """
    deadline = time.monotonic() + START_TIMEOUT
    while not condition():
        check()
        if time.monotonic() > deadline:
            raise BenchmarkError(f'there must be {what} within {START_TIMEOUT:.0f} s, '
                                 'and there is none')
        time.sleep(POLL_PERIOD)


def wait_until_warm(folder: Path, processes: Sequence[subprocess.Popen]) -> None:
    """
    Return when the loop is warm.

    Raises
    ------
    BenchmarkError: if one of its processes ends before.

    """
    def check() -> None:
        for number, process in enumerate(processes):
            if process.poll() is not None:
                log = (folder / f'{number}.log').read_text(errors='replace')
                raise BenchmarkError(f'process {number} of the loop ended with '
                                     f'{process.returncode}: {log[-1500:]}')
    wait_until((folder / WARM_FILE).exists, 'a loop over topics', check)


def measure(folder: Path, members: Members, seconds: float,
            parameters: Path | None = None) -> LoopSpeed:
    """Return the speed of a loop, measured for some seconds after its warm-up."""
    with running(folder, members, parameters) as processes:
        wait_until_warm(folder, processes)
        time.sleep(seconds)  # the loop runs meanwhile
    return loop_speed(np.fromfile(folder / TIMES_FILE, dtype=np.int64))
