# SPDX-License-Identifier: Apache-2.0
"""How processes end, with no orphaned child, and how they stop: Ctrl-C and Ctrl-Z."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
import ctypes
import os
import signal
import threading


class StopFlag:
    """
    Whether the user wants to stop.

    Unlike `threading.Event`, it takes no lock to be set: a second signal during the handler of
    the first would wait for that lock forever.
    """

    def __init__(self) -> None:
        self._is_set = False

    def set(self) -> None:
        """Stop as soon as possible."""
        self._is_set = True

    def is_set(self) -> bool:
        """Tell whether to stop."""
        return self._is_set


@contextmanager
def interrupts() -> Generator[StopFlag]:
    """
    Give a `StopFlag` that Ctrl-C and SIGTERM set while the block runs.

    A KeyboardInterrupt could be raised inside a callback that swallows it.
    """
    stop = StopFlag()
    before = {number: signal.signal(number, lambda *_: stop.set())
              for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def check(stop: StopFlag) -> None:
    """Raise KeyboardInterrupt if the flag is set."""
    if stop.is_set():
        raise KeyboardInterrupt


@contextmanager
def stops(before: Callable[[], object], after: Callable[[], object]) -> Generator[None]:
    """
    Call `before` when Ctrl-Z stops this process, and `after` when `fg` continues it.

    It does nothing outside of the main thread, and where SIGTSTP is ignored.
    """
    outer = signal.getsignal(signal.SIGTSTP)
    if threading.current_thread() is not threading.main_thread() or outer == signal.SIG_IGN:
        yield
        return

    def stop(*_: object) -> None:
        before()
        signal.signal(signal.SIGTSTP, outer)
        signal.raise_signal(signal.SIGTSTP)
        signal.signal(signal.SIGTSTP, stop)
        after()
    signal.signal(signal.SIGTSTP, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGTSTP, outer)


def end_with_parent(parent: int) -> None:
    """
    Have the kernel end this process, as by SIGTERM, when its parent ends (Linux).

    parent: process id; if the parent has ended already, this process ends now.
    """
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG
    if os.getppid() != parent:
        os._exit(0)
