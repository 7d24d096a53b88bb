# SPDX-License-Identifier: Apache-2.0
"""Nodes, executables and tools as processes, for tests."""

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
import os
from pathlib import Path
import subprocess
import sys

from waiting import DEADLINE

from comply_ros.nodes.node_processes import NodeProcess, run_nodes, START

ROOT = Path(__file__).parents[2]


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
    return subprocess.run(
        [sys.executable, '-c', START.format(name), *arguments], capture_output=True, text=True,
        timeout=timeout, check=False, env={**os.environ, **environment})


def tool_command(name: str, *arguments: str) -> list[str]:
    """Command of a tool such as `topic`, to be run in `ROOT`: tools are not installed."""
    return [sys.executable, '-m', 'tools', name, *arguments]


def run_tool(name: str, *arguments: str, timeout: float = DEADLINE) -> subprocess.CompletedProcess:
    """Run a tool to its end; return it with `returncode`, `stdout` and `stderr`."""
    return subprocess.run(tool_command(name, *arguments), cwd=ROOT, capture_output=True,
                          text=True, timeout=timeout, check=False)
