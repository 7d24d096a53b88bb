# SPDX-License-Identifier: Apache-2.0
"""Nodes, executables and tools as processes, for tests."""

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import re
import subprocess
import sys

from waiting import DEADLINE

from comply_ros.nodes.node_processes import NodeProcess, run_nodes, START

ROOT = Path(__file__).parents[2]
PORT_RACE = re.compile(r'.*RTPS_TRANSPORT_SHM.*Failed init_port.*\n')


def log_has(node: NodeProcess, text: str) -> Callable[[], bool]:
    """Return a condition: the node has printed the text; it fails when the node has ended."""
    def is_printed() -> bool:
        ended = node.end_report()
        if text in node.log.read_text(errors='replace'):
            return True
        assert ended is None, ended
        return False
    return is_printed


@contextmanager
def nodes(folder: Path, **arguments: Sequence[str]) -> Generator[dict[str, NodeProcess]]:
    """Run nodes by name, started in the given order, each with its ROS arguments."""
    Path(folder).mkdir(exist_ok=True)
    with run_nodes(arguments, folder) as processes:
        yield {process.name: process for process in processes}


def run(name: str, *arguments: str, timeout: float = DEADLINE,
        **environment: str) -> subprocess.CompletedProcess:
    """Run an executable to its end; return it with `returncode`, `stdout` and `stderr`."""
    return without_port_races(subprocess.run(
        [sys.executable, '-c', START.format(name), *arguments], capture_output=True, text=True,
        timeout=timeout, check=False, env={**os.environ, **environment}))


def without_port_races(done: subprocess.CompletedProcess) -> subprocess.CompletedProcess:
    """
    Return a process without what Fast DDS prints where two participants start at the same time.

    Both look for a free port of the shared memory, from 7000 on, in whatever domain they are. The
    one that comes second prints an error, and takes the next port.
    """
    done.stderr = PORT_RACE.sub('', done.stderr)
    return done


def tool_command(name: str, *arguments: str) -> list[str]:
    """Command of a tool such as `topic`, to be run in `ROOT`: tools are not installed."""
    return [sys.executable, '-m', 'tools', name, *arguments]


def run_tool(name: str, *arguments: str, timeout: float = DEADLINE) -> subprocess.CompletedProcess:
    """Run a tool to its end; return it with `returncode`, `stdout` and `stderr`."""
    return without_port_races(subprocess.run(
        tool_command(name, *arguments), cwd=ROOT, capture_output=True, text=True, timeout=timeout,
        check=False))
