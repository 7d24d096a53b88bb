# SPDX-License-Identifier: Apache-2.0
"""The nodes of a lesson as processes: started together, watched, and ended cleanly."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

START = 'import sys; from comply_ros.executables import {0}; sys.argv[0] = "{0}"; sys.exit({0}())'
CHILD = ('from comply_ros.terminal.interrupts import end_with_parent; end_with_parent({1}); '
         + START)
LAST_LINES = 12
PATIENCE = 5.0  # seconds that a node has to end after Ctrl-C
AT_MOST, RECENT = 20, 10.0  # starts of a node in so many seconds; more are no kills but a defect


class NodeDied(RuntimeError):
    """A node that ended by itself; the message has its name, exit code and last lines."""


class NodeProcess:
    """
    One of our nodes in a process of its own, with its output in a file.

    Parameters
    ----------
    name: of the executable.
    arguments: after `--ros-args`.
    folder: where `NAME.log` goes.

    """

    def __init__(self, name, arguments, folder):
        self.name, self.log = name, Path(folder) / f'{name}.log'
        self._arguments, self._starts = arguments, []
        self.log.write_bytes(b'')
        self.start()

    def start(self):
        """Start the process; its output goes behind what is in its file."""
        self._starts.append(time.monotonic())
        with self.log.open('ab') as output:
            self._process = subprocess.Popen(
                [sys.executable, '-P', '-c', CHILD.format(self.name, os.getpid()),
                 '--ros-args', '--enclave', f'/{self.name}', *self._arguments],
                stdout=output, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                start_new_session=True)  # Ctrl-C is for the lesson, which then ends its nodes

    @property
    def pid(self):
        """Process id."""
        return self._process.pid

    def check(self):
        """
        Return if the node lives.

        Raises
        ------
        NodeDied: if it does not.

        """
        code = self._process.poll()
        if code is not None:
            raise NodeDied(f'{self.name} ended with {_code(code)}; its last lines:\n'
                           f'{self.last_lines()}')

    def respawn(self):
        """
        Start the node again if it was killed; return whether it was.

        Raises
        ------
        NodeDied: if it ended by itself, or was killed too often in too short a time.

        """
        code = self._process.poll()
        if code is None:
            return False
        self._starts = [start for start in self._starts if start > time.monotonic() - RECENT]
        if code >= 0 or len(self._starts) > AT_MOST:
            self.check()
        self.start()
        return True

    def last_lines(self):
        """Return the end of what the node printed, indented."""
        lines = self.log.read_text(errors='replace').splitlines()[-LAST_LINES:]
        return '\n'.join(f'    {line}' for line in lines) or '    (it printed nothing)'

    def kill(self):
        """Kill the node as `kill -9` does; return whether it was alive."""
        alive = self._process.poll() is None
        self._process.send_signal(signal.SIGKILL)
        return alive

    def interrupt(self):
        """Ask the node to end, as Ctrl-C does."""
        if self._process.poll() is None:
            os.kill(self.pid, signal.SIGINT)

    def wait(self):
        """Return its exit code; a node that does not end in time is killed."""
        try:
            return self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()


def _code(code):
    return f'exit code {code}' if code >= 0 else f'signal {signal.Signals(-code).name}'
