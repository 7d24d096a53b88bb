# SPDX-License-Identifier: Apache-2.0
"""Nodes as processes: started together, watched, and ended cleanly."""

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager, suppress
import os
from pathlib import Path
import signal
import subprocess
import sys
import time
from types import MappingProxyType
from typing import Any

import yaml

from comply_ros.nodes.spin import HOLD
from comply_ros.terminal.interrupts import stops

START = 'import sys; from comply_ros.executables import {0}; sys.argv[0] = "{0}"; sys.exit({0}())'
CHILD = ('from comply_ros.terminal.interrupts import end_with_parent; end_with_parent({1}); '
         + START)
LAST_LINES = 12
END_TIMEOUT = 5.0  # seconds that a node has to end after Ctrl-C
MAX_STARTS, START_WINDOW = 20, 10.0  # starts in so many seconds; more are a defect, not kills


class _QuotingDumper(yaml.SafeDumper):
    """Puts every text into quotes: rcl reads 1e3 as a number, and what follows ' #' not at all."""


_QuotingDumper.add_representer(str, lambda dumper, text: dumper.represent_scalar(
    'tag:yaml.org,2002:str', text, style='"'))


def yaml_for_rcl(value: Any) -> str:
    """Return a value as YAML in which rcl finds the same value, whatever its texts contain."""
    text = yaml.dump(value, Dumper=_QuotingDumper, sort_keys=False, width=float('inf'))
    return text.removesuffix('...\n')


def parameter_arguments(parameters: Mapping[str, Any]) -> list[str]:
    """Return the ROS arguments that set parameters, `-p NAME:=VALUE` for each."""
    return [argument for name, value in parameters.items()
            for argument in ('-p', f'{name}:={yaml_for_rcl(value).strip()}')]


class NodeDied(RuntimeError):
    """A node that ended by itself; the message has its name, exit code and last lines."""


class NodeProcess:
    """
    One of our nodes in a process of its own, with its output in a file.

    Parameters
    ----------
    name: of the node.
    arguments: after `--ros-args`.
    folder: of the log file, `NAME.log`.
    held: whether it loads what it needs and then waits for `release` before it makes its node.
    executable: what it runs, where that is not called as the node.

    """

    def __init__(self, name: str, arguments: Sequence[str], folder: Path | str,
                 held: bool = False, executable: str = '') -> None:
        self.name, self.log = name, Path(folder) / f'{name}.log'
        self._executable = executable or name
        self.pids: list[int] = []  # of all its processes, the last one that of now
        self._arguments, self._starts = arguments, []
        self.log.write_bytes(b'')
        self.start(held)

    def start(self, held: bool = False) -> None:
        """Start the process, which must not run; its output is appended to the log."""
        self._starts.append(time.monotonic())
        with self.log.open('ab') as output:
            self._process = subprocess.Popen(
                [sys.executable, '-P', '-c', CHILD.format(self._executable, os.getpid()),
                 '--ros-args', '--enclave', f'/{self._executable}', *self._rename(),
                 *self._arguments],
                stdin=subprocess.PIPE if held else subprocess.DEVNULL, stdout=output,
                stderr=subprocess.STDOUT, env={**os.environ, HOLD: '1'} if held else None,
                start_new_session=True)  # Ctrl-C is for the lesson, which then ends its nodes
        self.pids.append(self._process.pid)

    def _rename(self) -> list[str]:
        return ['-r', f'__node:={self.name}'] if self.name != self._executable else []

    def release(self) -> None:
        """Let a held process make its node."""
        if self._process.stdin:
            with suppress(BrokenPipeError):  # it has died: `check` tells
                self._process.stdin.write(b'\n')
                self._process.stdin.close()

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def end_report(self) -> str | None:
        """Return how the node ended, with its last lines; None while it runs."""
        code = self._process.poll()
        if code is None:
            return None
        how = f'exit code {code}' if code >= 0 else f'signal {signal.Signals(-code).name}'
        return f'{self.name} ended with {how}; its last lines:\n{self.last_lines()}'

    def check(self) -> None:
        """Return if the node runs; raises NodeDied."""
        report = self.end_report()
        if report is not None:
            raise NodeDied(report)

    def respawn(self) -> bool:
        """
        Start the node again if it was killed; return whether it was.

        Raises NodeDied if it ended by itself, or was killed too often in too short a time.
        """
        code = self._process.poll()
        if code is None:
            return False
        self._starts = [start for start in self._starts
                        if start > time.monotonic() - START_WINDOW]
        if code >= 0 or len(self._starts) > MAX_STARTS:
            self.check()
        self.start()
        return True

    def last_lines(self) -> str:
        """Return the end of what the node printed, indented."""
        lines = self.log.read_text(errors='replace').splitlines()[-LAST_LINES:]
        return '\n'.join(f'    {line}' for line in lines) or '    (it printed nothing)'

    def kill(self) -> bool:
        """Kill the node as `kill -9` does; return whether it was alive."""
        alive = self._process.poll() is None
        self._process.send_signal(signal.SIGKILL)
        return alive

    def interrupt(self) -> None:
        """Ask the node to end, as Ctrl-C does."""
        if self._process.poll() is None:
            os.kill(self.pid, signal.SIGINT)

    def stop(self) -> None:
        """Let the node do nothing until `resume`."""
        self._process.send_signal(signal.SIGSTOP)

    def resume(self) -> None:
        """Let the node go on after `stop`."""
        self._process.send_signal(signal.SIGCONT)

    def wait(self) -> int:
        """Return the exit code; a node that does not end in time is killed."""
        try:
            return self._process.wait(END_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()


@contextmanager
def ended_with_block() -> Generator[list[NodeProcess], None, None]:
    """
    Give an empty list; the nodes that are put into it end with the block, whatever happens.

    Ctrl-Z stops them with this process, and `fg` lets them go on.
    """
    processes: list[NodeProcess] = []
    try:
        with stops(lambda: [process.stop() for process in processes],
                   lambda: [process.resume() for process in processes]):
            yield processes
    finally:
        for process in processes:
            process.interrupt()
        for process in processes:
            process.wait()


@contextmanager
def run_nodes(arguments: Mapping[str, Sequence[str]], folder: Path | str, held: bool = False,
              executables: Mapping[str, str] = MappingProxyType({}),
              ) -> Generator[list[NodeProcess], None, None]:
    """
    Run nodes, with ROS arguments by name, that end with the block, whatever happens in it.

    executables: of nodes that are called otherwise than what they run, by name.
    """
    with ended_with_block() as processes:
        for name, values in arguments.items():
            processes.append(NodeProcess(name, values, folder, held, executables.get(name, '')))
        yield processes
