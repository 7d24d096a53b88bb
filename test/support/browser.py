# SPDX-License-Identifier: Apache-2.0
"""Nodes with a dashboard, and a real browser that opens its page, for tests."""

from contextlib import contextmanager
import re
import shutil

from node_processes import log_has, nodes
import pytest
from waiting import DEADLINE, wait_until

CHROMIUMS = ('chromium', 'chromium-browser', 'google-chrome')


@contextmanager
def browser():
    """Give a real browser; without one, skip the test."""
    playwright = pytest.importorskip('playwright.sync_api', reason='playwright is not installed')
    path = next(filter(None, map(shutil.which, CHROMIUMS)), None)
    if path is None:
        pytest.skip(f'no browser is installed: none of {", ".join(CHROMIUMS)}')
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=path, args=['--no-sandbox'])
        try:
            yield chromium
        finally:
            chromium.close()


@contextmanager
def running_dashboard(folder, *arguments, remembers='true', **more):
    """Run a world, a learner and a dashboard with a mentor; give the processes and the URL."""
    world = ['-p', 'map:=bar_grid', '-p', 'rate:=300.0']
    learner = ['-p', 'iterations:=0', '-p', 'episodes:=5', '-p', 'map_period:=0.2',
               '-p', f'remembers_advice:={remembers}']
    with nodes(folder, grid_world=world, learner=learner,
               dashboard=['-p', 'port:=0', *arguments], **more) as running:
        wait_until(log_has(running['dashboard'], 'ready:'), 'page')
        yield running, url_of(running['dashboard'])


def url_of(dashboard):
    """URL that a dashboard has printed."""
    return re.search(r'ready:\s(\S+)', dashboard.log.read_text())[1]


def open_page(chromium, url, **settings):
    """Return a page of the browser that shows the world."""
    page = chromium.new_page(viewport={'width': 1280, 'height': 900}, **settings)
    page.set_default_timeout(DEADLINE * 1000)
    page.goto(url)
    page.locator('.world').first.wait_for()
    page.wait_for_function('() => window.did_handshake')
    wait_until(lambda: not page.get_by_test_id('alarm').is_visible(), 'end of the alarm')
    return page


def drag(page, grid, *cells):
    """Drag the pointer over the middles of cells (x, y), (0, 0) at the lower left."""
    box = page.locator('.world').first.bounding_box()
    side = box['width'] / grid.width
    for number, (x, y) in enumerate(cells):
        page.mouse.move(box['x'] + (x + 0.5) * side,
                        box['y'] + (grid.height - y - 0.5) * side)
        if number == 0:
            page.mouse.down()
    page.mouse.up()


def text_of(page, test_id):
    """Text of an element."""
    return page.get_by_test_id(test_id).inner_text()


def wait_for(page, test_id, pattern):
    """Return the match as soon as the text of an element matches a pattern."""
    return wait_until(lambda: re.search(pattern, text_of(page, test_id)),
                      f'{pattern!r} in {test_id}')
