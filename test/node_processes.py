# SPDX-License-Identifier: Apache-2.0
"""Real nodes in real processes, for tests: waits are for conditions, with a deadline."""

from contextlib import contextmanager
import os
from pathlib import Path
import subprocess
import sys
import time

from comply_ros.nodes.node_processes import run_nodes, START

DEADLINE = 90.0


def wait_until(condition, what, deadline=DEADLINE):
    """Return what the condition returns as soon as it is true; fail after the deadline."""
    end = time.monotonic() + deadline
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.01)
    raise AssertionError(f'no {what} within {deadline} s')


def log_has(node, text):
    """Return a condition: the node has printed the text."""
    return lambda: text in node.log.read_text(errors='replace')


@contextmanager
def nodes(folder, **arguments):
    """Run nodes by name, started in the order given, each with its ROS arguments."""
    Path(folder).mkdir(exist_ok=True)
    with run_nodes(arguments, folder) as processes:
        yield {process.name: process for process in processes}


def run(name, *arguments, timeout=60, **environment):
    """Run an executable to its end; return it with `returncode`, `stdout` and `stderr`."""
    return subprocess.run(
        [sys.executable, '-c', START.format(name), *arguments], capture_output=True, text=True,
        timeout=timeout, check=False, env={**os.environ, **environment})
