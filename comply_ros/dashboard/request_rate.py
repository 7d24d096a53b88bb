# SPDX-License-Identifier: Apache-2.0
"""How often each address may guess the token, and how often it may send a request."""

import asyncio
from collections import OrderedDict
from collections.abc import Callable
import time

FREE_GUESSES = 5  # wrong guesses in a row that are answered at once: people mistype
SECONDS_PER_GUESS = 2.0  # after those
FREE_REQUESTS = 300  # in a row: a page with all its files has about 40
SECONDS_PER_REQUEST = 0.02  # after those
MAX_DELAY = 5.0  # seconds that an answer is delayed
MAX_ADDRESSES = 10_000  # that are remembered


class RateLimit:
    """
    Counts what each address does, and tells how long it has to wait before it does it again.

    Parameters
    ----------
    free: how many in a row need not wait.
    seconds: that each counts, after those.
    clock: seconds by a steady clock.

    """

    def __init__(self, free: int, seconds: float,
                 clock: Callable[[], float] = time.monotonic) -> None:
        self._free, self._seconds, self._clock = free, seconds, clock
        self._paid_until: OrderedDict[str, float] = OrderedDict()  # by address, newest last

    def wait(self, address: str) -> float:
        """Seconds until this address may do it again; 0.0: now."""
        allowed = self._paid_until.get(address, 0.0) - self._free * self._seconds
        return max(0.0, allowed + self._seconds - self._clock())

    def add(self, address: str) -> None:
        """Count one more."""
        until = max(self._paid_until.pop(address, 0.0), self._clock())
        self._paid_until[address] = until + self._seconds
        if len(self._paid_until) > MAX_ADDRESSES:
            self._paid_until.popitem(last=False)


class RequestRate:
    """
    Delays requests of an address that sends too many.

    Those who send the next request when they have an answer, in a loop or in hundreds of them,
    then cost next to nothing, whatever the answer is.

    sleep: waits so many seconds.
    """

    def __init__(self, limit: RateLimit | None = None,
                 sleep: Callable = asyncio.sleep) -> None:
        self._limit = limit or RateLimit(FREE_REQUESTS, SECONDS_PER_REQUEST)
        self._sleep = sleep

    async def admits(self, address: str) -> bool:
        """Wait until a request may be answered; return False for one too many, after a delay."""
        wait = self._limit.wait(address)
        is_admitted = wait <= MAX_DELAY
        if is_admitted:
            self._limit.add(address)
        if wait:
            await self._sleep(min(wait, MAX_DELAY))
        return is_admitted
