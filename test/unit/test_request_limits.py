# SPDX-License-Identifier: Apache-2.0
"""How many pages visitors may open, and how much they may send."""

import asyncio
from types import SimpleNamespace

import pytest

from comply_ros.dashboard.request_limits import (
    MAX_BODY,
    MAX_QUEUE,
    MAX_UNCONNECTED,
    RequestLimits,
    SLOT,
)


class Visitor(SimpleNamespace):
    """A request for a page, and the events of the client that belongs to it."""

    def __init__(self, number):
        super().__init__(id=str(number), handlers={}, sent=[], gone=asyncio.Event())
        self.on_connect = lambda handler: self.handlers.update(connect=handler)
        self.on_delete = lambda handler: self.handlers.update(delete=handler)

    def delete(self):
        self.handlers['delete']()

    async def ask(self, limits, path='/', **headers):
        async def receive():
            await self.gone.wait()
            return {'type': 'http.disconnect'}

        async def send(message):
            self.sent.append(message)
        await limits({'type': 'http', 'path': path, 'visitor': self, 'headers': [
            (name.replace('_', '-').encode(), value.encode())
            for name, value in headers.items()]}, receive, send)

    @property
    def status(self):
        return self.sent[0]['status'] if self.sent else None


def page_server():
    """Return limits around an application that sends a page to everybody."""
    async def app(scope, receive, send):
        visitor = scope['visitor']
        if SLOT in scope:
            visitor.request = SimpleNamespace(scope=scope)
            limits.add_page(visitor)
        await send({'status': 200})
    limits = RequestLimits(app)
    return limits


async def settle():
    for _ in range(10):
        await asyncio.sleep(0)


def test_pages_that_no_browser_connects_to_wait_for_each_other():
    async def flood():
        limits = page_server()
        visitors = [Visitor(number) for number in range(MAX_UNCONNECTED + MAX_QUEUE + 1)]
        tasks = []
        for group in visitors[:MAX_UNCONNECTED], visitors[MAX_UNCONNECTED:]:
            tasks += [asyncio.ensure_future(each.ask(limits)) for each in group]
            await settle()
        assert [each.status for each in visitors] == (
            [200] * MAX_UNCONNECTED + [None] * MAX_QUEUE + [503])
        visitors[0].handlers['connect']()
        visitors[1].delete()
        await settle()
        assert [each.status for each in visitors[MAX_UNCONNECTED:][:3]] == [200, 200, None]
        other = Visitor('other')
        await other.ask(limits, '/_nicegui/file.js')
        assert other.status == 200
        for each in tasks:
            each.cancel()
    asyncio.run(flood())


def test_no_page_is_built_for_a_visitor_who_has_left():
    async def visit():
        limits = page_server()
        visitors = [Visitor(number) for number in range(MAX_UNCONNECTED + 2)]
        tasks = [asyncio.ensure_future(each.ask(limits)) for each in visitors]
        await settle()
        leaving, waiting = visitors[MAX_UNCONNECTED:]
        leaving.gone.set()
        await settle()
        visitors[0].handlers['connect']()
        await settle()
        assert (leaving.status, waiting.status) == (503, 200)
        for each in tasks:
            each.cancel()
    asyncio.run(visit())


def test_a_page_from_which_no_browser_connects_is_freed(monkeypatch):
    monkeypatch.setattr('comply_ros.dashboard.request_limits.CONNECT_TIMEOUT', 0.01)

    async def visit():
        limits = page_server()
        for number in range(3 * MAX_UNCONNECTED):
            visitor = Visitor(number)
            await visitor.ask(limits)
            assert visitor.status == 200
    asyncio.run(asyncio.wait_for(visit(), 30.0))


@pytest.mark.parametrize('headers, status', [
    ({'content_length': str(MAX_BODY)}, 200), ({'content_length': str(MAX_BODY + 1)}, 413),
    ({'content_length': '-1'}, 413), ({'transfer_encoding': 'chunked'}, 411)])
def test_a_body_that_is_too_large_or_does_not_say_how_large_it_is_is_not_read(headers, status):
    visitor = Visitor(0)
    asyncio.run(visitor.ask(page_server(), '/_nicegui/client/1/upload/2', **headers))
    assert visitor.status == status


def test_no_page_is_built_for_a_path_that_is_not_there():
    visitor = Visitor(0)
    asyncio.run(visitor.ask(page_server(), '/elsewhere'))
    assert visitor.status == 404
