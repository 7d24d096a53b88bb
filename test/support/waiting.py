# SPDX-License-Identifier: Apache-2.0
"""Waits for conditions."""

from collections.abc import Callable
import time
from typing import TypeVar

DEADLINE = 150.0  # seconds; a machine with much other work meets it
Value = TypeVar('Value')


def wait_until(condition: Callable[[], Value], what: str, deadline: float = DEADLINE) -> Value:
    """Return what the condition returns as soon as it is true; fail after the deadline."""
    end = time.monotonic() + deadline
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.01)
    raise AssertionError(f'no {what} within {deadline} s')
