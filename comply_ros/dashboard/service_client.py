# SPDX-License-Identifier: Apache-2.0
"""To ask another node for something from another thread: services as futures for asyncio."""

import asyncio
from concurrent.futures import Future
from queue import Empty, SimpleQueue

PATIENCE = 3.0  # seconds that a node has to answer


class NoAnswerError(RuntimeError):
    """A service that nobody serves, that does not answer, or refuses; the message says why."""


class ServiceClient:
    """
    Calls services of other nodes in the thread of this one.

    Parameters
    ----------
    node: that asks.
    services: pairs (type, name) of all services that will be asked for.

    """

    def __init__(self, node, services):
        self._todo = SimpleQueue()
        self._clients = {name: node.create_client(kind, name) for kind, name in services}

    async def ask(self, name, request):
        """
        Return the response of a service; for the thread of the page.

        Raises
        ------
        NoAnswerError: if there is none within some seconds.

        """
        try:
            return await asyncio.wait_for(asyncio.wrap_future(self.begin(name, request)), PATIENCE)
        except TimeoutError:
            raise NoAnswerError(f'{name} must be answered within {PATIENCE:g} s, '
                                'and was not: is its node well?') from None

    def begin(self, name, request):
        """Return the `Future` response of a service, which `work` asks for; for any thread."""
        future = Future()
        self._todo.put(lambda: self._send(name, request, future))
        return future

    def work(self, seconds):
        """Send what is to be asked, and wait so long for more of it; for the thread of ROS."""
        try:
            self._todo.get(timeout=seconds)()
        except Empty:
            return
        while not self._todo.empty():
            self._todo.get()()

    def _send(self, name, request, future):
        client = self._clients[name]
        if not future.set_running_or_notify_cancel():
            return
        if not client.service_is_ready():
            node = name.partition('/')[0]
            future.set_exception(NoAnswerError(
                f'{node} must be running to be asked for {name}, and nobody serves that'))
            return
        client.call_async(request).add_done_callback(lambda done: _pass_on(done, future))


def _pass_on(done, future):
    """Settle a future as one of rclpy was settled."""
    if done.exception():
        future.set_exception(done.exception())
    else:
        future.set_result(done.result())
