# SPDX-License-Identifier: Apache-2.0
"""Standard output that may be closed before a command ends, or lack letters for a name."""

from collections.abc import Generator
from contextlib import contextmanager
import io
import os
import select
import signal
import sys

BROKEN_PIPE = 128 + signal.SIGPIPE  # exit code, as a shell has it of a program that it ended


def is_closed() -> bool:
    """Whether the other end of the pipe of standard output or standard error has been closed."""
    poll = select.poll()
    for file in (1, 2):
        poll.register(file, 0)  # errors are reported in any case
    return any(events & select.POLLERR for _, events in poll.poll(0))


@contextmanager
def standard_output() -> Generator[None]:
    """
    End the process quietly where what it prints to was closed (`train | head -1`).

    Letters that the terminal's encoding does not have are escaped.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')
    try:
        try:
            yield
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()
    except BrokenPipeError:
        if not is_closed():
            raise
        _discard_output()
        raise SystemExit(BROKEN_PIPE) from None


def _discard_output() -> None:
    """Let what is still printed go nowhere, without an error."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for file in (1, 2):
        os.dup2(nowhere, file)
    os.close(nowhere)
