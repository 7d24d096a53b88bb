# SPDX-License-Identifier: Apache-2.0
"""How often the page is renewed."""

import asyncio

from comply_ros.dashboard.page import keep_showing


async def settle():
    for _ in range(10):
        await asyncio.sleep(0)


def test_a_page_is_not_renewed_before_its_browser_has_answered(monkeypatch):
    monkeypatch.setattr('comply_ros.dashboard.page.PERIOD', 0.0)
    shown, answers = [], asyncio.Semaphore(0)

    async def visit():
        showing = asyncio.ensure_future(keep_showing(
            lambda: shown.append(1), lambda: len(shown) == 3, answers.acquire))
        for number in 1, 2:
            await settle()
            assert len(shown) == number
            answers.release()
        await settle()
        answers.release()
        await showing
    asyncio.run(visit())
    assert len(shown) == 3


def test_an_error_of_one_renewal_does_not_end_the_page(monkeypatch):
    monkeypatch.setattr('comply_ros.dashboard.page.PERIOD', 0.0)
    errors, shown = [], []
    monkeypatch.setattr('comply_ros.dashboard.page.app.handle_exception', errors.append)

    def show():
        shown.append(1)
        if len(shown) == 1:
            raise ValueError('not this time')
    asyncio.run(keep_showing(show, lambda: len(shown) == 2, lambda: asyncio.sleep(0)))
    assert len(errors) == 1 and len(shown) == 2
