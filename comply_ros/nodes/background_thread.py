# SPDX-License-Identifier: Apache-2.0
"""Calls in a thread, for what would make a node wait."""

from collections.abc import Callable
from concurrent.futures import Future
from threading import Thread
from typing import Any


def in_background(function: Callable[..., Any], *arguments: Any) -> Future[Any]:
    """Return the `Future` of a call in a thread that does not keep the process alive."""
    future: Future[Any] = Future()

    def call() -> None:
        try:
            future.set_result(function(*arguments))
        except Exception as error:  # noqa: BLE001 - the caller of `result` gets it
            future.set_exception(error)
    Thread(target=call, daemon=True).start()
    return future
