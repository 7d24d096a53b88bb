# SPDX-License-Identifier: Apache-2.0
"""How processes end: Ctrl-C as a question asked between two steps, and no child left alone."""

from contextlib import contextmanager
import ctypes
import os
import signal


class Stop:
    """
    Whether somebody wants to stop.

    A `threading.Event` takes a lock to be set: a second signal on top of the first would wait for
    itself forever.
    """

    def __init__(self):
        self._wanted = False

    def set(self):
        """Stop as soon as possible."""
        self._wanted = True

    def is_set(self):
        """Tell whether to stop."""
        return self._wanted


@contextmanager
def interrupts():
    """
    Give a `Stop` that Ctrl-C and SIGTERM set while the block runs.

    A KeyboardInterrupt can come up inside a callback that swallows it; this cannot.
    """
    stop = Stop()
    before = {number: signal.signal(number, lambda *_: stop.set())
              for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def check(stop):
    """
    Return if nobody wants to stop.

    Raises
    ------
    KeyboardInterrupt: if it is set.

    """
    if stop.is_set():
        raise KeyboardInterrupt


def end_with_parent(parent):
    """
    Arrange that this process ends, as by SIGTERM, when the one that started it does (Linux).

    parent: its process id; if it has ended already, this process ends now.
    """
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG
    if os.getppid() != parent:
        os._exit(0)
