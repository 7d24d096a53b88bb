# SPDX-License-Identifier: Apache-2.0
"""The page in a real browser, among pages of other sites."""

from browser import browser, running_dashboard
from http_server import http_server
import pytest
from waiting import DEADLINE


@pytest.fixture
def chromium():
    with browser() as chromium:
        yield chromium


def site(html):
    """Serve a page of another site; give its URL."""
    return http_server(lambda request: (200, [('content-type', 'text/html')], html.encode()))


def test_no_page_frames_ours_and_its_own_policy_breaks_nothing(domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (_, url), site(f'<iframe src="{url}"></iframe>') as other:
        page = chromium.new_page()
        page.set_default_timeout(DEADLINE * 1000)
        problems = []
        page.on('console', lambda line: problems.append(line.text) if line.type == 'error' else '')
        page.on('pageerror', lambda error: problems.append(str(error)))
        page.goto(url)
        page.locator('.world').first.wait_for()
        page.wait_for_function('() => window.did_handshake')
        assert problems == []
        framing = chromium.new_page()
        framing.goto(other)
        frame = framing.frames[1]
        assert frame.locator('.world').count() == 0
        assert 'comply_ros' not in frame.content()


def test_another_site_that_uses_our_page_as_a_picture_gets_nothing(domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (_, url), site(f'<img src="{url}">') as other:
        page = chromium.new_page()
        page.set_default_timeout(DEADLINE * 1000)
        with page.expect_event('requestfailed') as failed:
            page.goto(other)
        assert failed.value.url == url
        page.set_content(f'<a href="{url}">the page</a>')
        page.get_by_text('the page').click()
        page.get_by_text('Open the page').click()
        page.locator('.world').first.wait_for()
