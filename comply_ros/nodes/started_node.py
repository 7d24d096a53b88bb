# SPDX-License-Identifier: Apache-2.0
"""A node that `check` starts by a command of the user, and ends again."""

from contextlib import suppress
from errno import ENOENT
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SEED = '{seed}'  # in the command, for the seed of the node
END_TIME = 10.0  # seconds that a node has to end after Ctrl-C
CHILDREN_TIME = 1.0  # seconds that what it started has longer
LAST_LINES = 5
CHILD = ('import os, sys; from comply_ros.terminal.interrupts import end_with_parent; '
         'end_with_parent({0}); os.execvp(sys.argv[1], sys.argv[1:])')


class StartedNode:
    """
    The processes of a command, at most one at a time.

    command: as in a shell, with `SEED` where the seed of the node goes.
    """

    def __init__(self, command: str) -> None:
        self._command, self._process = command, None
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - it is written to until the end

    _process: subprocess.Popen[bytes] | None

    @property
    def has_seed(self) -> bool:
        """Whether the command has a place for the seed."""
        return SEED in self._command

    @property
    def has_ended(self) -> bool:
        """Whether the command was started, and has ended by itself."""
        return self._process is not None and self._process.poll() is not None

    def start(self, seed: int) -> None:
        """
        Start the node with a seed; it ends when this process is killed.

        Raises
        ------
        OSError, ValueError: for a command that cannot be run.

        """
        words = [word.replace(SEED, str(seed)) for word in shlex.split(self._command)]
        if not words or shutil.which(words[0]) is None:
            raise FileNotFoundError(ENOENT, 'no such program', words[0] if words else '')
        self._process = subprocess.Popen(
            [sys.executable, '-P', '-c', CHILD.format(os.getpid()), *words],
            stdin=subprocess.DEVNULL, stdout=self._log, stderr=subprocess.STDOUT,
            start_new_session=True)

    def end(self) -> None:
        """End the node as Ctrl-C does, with all that its command started; kill it if it stays."""
        process, self._process = self._process, None
        if process is None:
            return
        with suppress(ProcessLookupError, subprocess.TimeoutExpired):
            os.killpg(process.pid, signal.SIGINT)
            process.wait(END_TIME)
        end = time.monotonic() + CHILDREN_TIME
        with suppress(ProcessLookupError):
            while process.returncode is not None and time.monotonic() < end:
                os.killpg(process.pid, 0)  # whether there still is one
                time.sleep(0.02)
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

    def last_lines(self) -> str:
        """Return the end of what the command printed, indented."""
        self._log.seek(0)
        lines = self._log.read().decode(errors='replace').splitlines()[-LAST_LINES:]
        return '\n'.join(f'    {line}' for line in lines) or '    (it printed nothing)'
