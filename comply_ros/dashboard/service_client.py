# SPDX-License-Identifier: Apache-2.0
"""Calls services of other nodes from the thread of the page, which does not spin a node."""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from queue import Empty, Queue
from typing import Any

from rclpy.client import Client
from rclpy.node import Node

from comply_ros.nodes.human_mentor import resolve

ANSWER_TIMEOUT = 3.0  # seconds that a node has to answer


class ServiceCallError(RuntimeError):
    """A service that is not there, does not answer, or reports a failure; the message says why."""


class ServiceClient:
    """Calls services for any thread, in the one that calls `send_pending` and spins the node."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._clients: dict[str, Client] = {}
        # Not a SimpleQueue: in Python 3.11 its `get` never returns if a signal comes and the time
        # is over before the signal's handler has run.
        self._pending: Queue[Callable[[], None]] = Queue()

    def add(self, service_type: Any, name: str) -> None:
        """Create the client of a service that will be called, once."""
        if name not in self._clients:
            self._clients[name] = self._node.create_client(service_type, name)

    async def call(self, name: str, request: Any) -> Any:
        """Return the response of a service, for the page; raises ServiceCallError if none came."""
        try:
            return await asyncio.wait_for(asyncio.wrap_future(self.send(name, request)),
                                          ANSWER_TIMEOUT)
        except TimeoutError:
            raise ServiceCallError(f'{name} must answer within {ANSWER_TIMEOUT:g} s, and did not: '
                                   'is its node well?') from None

    def send(self, name: str, request: Any) -> Future:
        """Return the `Future` of a response, for any thread."""
        client, future = self._clients[name], Future()

        def call() -> None:
            if not future.set_running_or_notify_cancel():
                return
            if client.service_is_ready():
                client.call_async(request).add_done_callback(
                    lambda done: resolve(future, done.result))
            else:
                future.set_exception(ServiceCallError(
                    f'service {name} must be there to be called, and is not: is the node '
                    f'{name.rpartition("/")[0]} running?'))
        self._pending.put(call)
        return future

    def send_pending(self, timeout: float) -> None:
        """Wait so many seconds at most for a request, and send all that there are."""
        try:
            self._pending.get(timeout=timeout)()
            while True:
                self._pending.get_nowait()()
        except Empty:
            return
