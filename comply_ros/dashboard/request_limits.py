# SPDX-License-Identifier: Apache-2.0
"""How many pages visitors may open, and how much they may send."""

import asyncio
from collections.abc import Callable
from typing import Any

from comply_ros.dashboard.access_control import FRAME, header, respond

MAX_UNCONNECTED = 4  # pages that were sent, and from which no browser has connected yet
CONNECT_TIMEOUT = 45.0  # seconds that a browser has to connect; then its page is freed
MAX_PAGES = 100  # that are open
MAX_QUEUE = 50  # requests for a page that wait
QUEUE_TIMEOUT = 30.0  # seconds that one waits
MAX_BODY = 21_000_000  # bytes of a request: a policy file of the largest grid, and its envelope
MAX_MESSAGE = 1_000_000  # bytes of a message over the WebSocket
SLOT = 'comply_ros.slot'  # key of a request's scope
BUSY = FRAME.format('<meta http-equiv="refresh" content="3"><p>Too many pages are being opened: '
                    'this one tries again.')


class PageSlot:
    """The right to send one page; it returns when a browser has connected, or never will."""

    def __init__(self, on_release: Callable[[], None]) -> None:
        self._on_release, self.is_used = on_release, False
        self._released = False

    def release(self) -> None:
        """Return the right, once."""
        if not self._released:
            self._released = True
            self._on_release()


class RequestLimits:
    """
    An ASGI application that makes requests for a page wait, and rejects bodies that are too large.

    A page costs time and memory before its browser connects. Those who load pages in a loop and
    never connect wait for each other, first come, first served; all else is served meanwhile.
    """

    def __init__(self, app: Callable) -> None:
        self._app = app
        self._free, self._waiting = asyncio.Semaphore(MAX_UNCONNECTED), 0
        self._pages: set[str] = set()  # ids of clients

    async def __call__(self, scope: dict[str, Any], receive: Callable, send: Callable) -> None:
        """Answer one request, or reject it."""
        if scope['type'] != 'http':
            await self._app(scope, receive, send)
        elif (problem := _body_problem(scope)) is not None:
            await respond(send, *problem, (b'connection', b'close'))
        elif scope['path'] == '/':
            await self._send_page(scope, receive, send)
        elif scope['path'].startswith(('/_nicegui', '/favicon.ico')):
            await self._app(scope, receive, send)
        else:  # the library would build a page for this too
            await respond(send, 404, FRAME.format('<p>There is no such page.'))

    async def _send_page(self, scope: dict[str, Any], receive: Callable, send: Callable) -> None:
        gone = asyncio.ensure_future(_is_gone(receive))
        try:
            if not await self._is_admitted(gone):
                await respond(send, 503, BUSY, (b'retry-after', b'3'))
                return
            slot = PageSlot(self._free.release)
            try:
                await self._app({**scope, SLOT: slot}, _receive_nothing(gone), send)
            finally:
                if not slot.is_used:
                    slot.release()
        finally:
            gone.cancel()

    async def _is_admitted(self, gone: asyncio.Future) -> bool:
        """
        Wait for one of the free slots and take it; return False where there are too many.

        gone: done when the visitor does not wait any longer.

        """
        if self._waiting >= MAX_QUEUE or len(self._pages) >= MAX_PAGES:
            return False
        self._waiting += 1
        turn = asyncio.ensure_future(self._free.acquire())
        try:
            await asyncio.wait((turn, gone), timeout=QUEUE_TIMEOUT,
                               return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._waiting -= 1
            if not turn.done():
                turn.cancel()
            elif gone.done():
                self._free.release()
        return turn.done() and not gone.done()

    def add_page(self, client: Any) -> None:
        """Have a client of NiceGUI, just made, use the slot of its request until it connects."""
        slot = client.request.scope[SLOT]
        slot.is_used = True
        self._pages.add(client.id)

        def on_delete() -> None:
            self._pages.discard(client.id)
            slot.release()
        timeout = asyncio.get_running_loop().call_later(CONNECT_TIMEOUT, client.delete)

        def on_connect() -> None:
            timeout.cancel()
            slot.release()
        client.on_connect(on_connect)
        client.on_delete(on_delete)


async def _is_gone(receive: Callable) -> None:
    """Return when the visitor has disconnected."""
    while (await receive())['type'] != 'http.disconnect':
        pass


def _receive_nothing(gone: asyncio.Future) -> Callable:
    """Return the `receive` of a request without a body, whose visitor leaves when `gone` does."""
    bodies = [{'type': 'http.request', 'body': b'', 'more_body': False}]

    async def receive() -> dict[str, Any]:
        if not bodies:
            await asyncio.shield(gone)
            return {'type': 'http.disconnect'}
        return bodies.pop()
    return receive


def _body_problem(scope: dict[str, Any]) -> tuple[int, str] | None:
    """Return the status and text of why the body of a request is not read; None: it may be."""
    if header(scope, b'transfer-encoding'):
        return 411, FRAME.format('<p>A request must say how long it is.')
    length = header(scope, b'content-length')
    if length and not (length.isdecimal() and int(length) <= MAX_BODY):
        return 413, FRAME.format(f'<p>A request must have at most {MAX_BODY} bytes.')
    return None
