# SPDX-License-Identifier: Apache-2.0
"""How often a visitor may guess the token."""

from collections import OrderedDict
from collections.abc import Callable
import time

FREE_GUESSES = 5  # wrong guesses in a row that are answered at once: people mistype
SECONDS_PER_GUESS = 2.0  # after those
MAX_ADDRESSES = 10_000  # that are remembered


class GuessLimit:
    """
    Counts wrong guesses by address, and tells how long the next one has to wait.

    clock: seconds by a steady clock.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._paid_until: OrderedDict[str, float] = OrderedDict()  # by address, newest last

    def wait(self, address: str) -> float:
        """Seconds until this address may guess again; 0.0: now."""
        allowed = self._paid_until.get(address, 0.0) - FREE_GUESSES * SECONDS_PER_GUESS
        return max(0.0, allowed + SECONDS_PER_GUESS - self._clock())

    def add_wrong(self, address: str) -> None:
        """Count a wrong guess."""
        until = max(self._paid_until.pop(address, 0.0), self._clock())
        self._paid_until[address] = until + SECONDS_PER_GUESS
        if len(self._paid_until) > MAX_ADDRESSES:
            self._paid_until.popitem(last=False)
