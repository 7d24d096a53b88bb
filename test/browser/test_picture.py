# SPDX-License-Identifier: Apache-2.0
"""The picture of an environment on the page. Skipped where Gymnasium is not installed."""

from browser import browser, open_page, running_dashboard, url_of
from node_processes import log_has, nodes
from own_environments import write_environments
import pytest
from waiting import wait_until

pytest.importorskip('gymnasium')


def source_of(page):
    """Return the address of the picture, '' while there is none."""
    return page.locator('.picture img').get_attribute('src') or ''


def test_the_picture_follows_the_environment_until_it_is_switched_off(
        domain, tmp_path, monkeypatch):
    write_environments(tmp_path, monkeypatch)
    world = ['-p', 'env:=Drawn-v0', '-p', 'module:=own_envs', '-p', 'rate:=20.0']
    learner = ['-p', 'method:=q_learning_epsilon', '-p', 'iterations:=0']
    with nodes(tmp_path / 'nodes', gym_world=world, learner=learner,
               dashboard=['-p', 'port:=0', '-p', 'teach:=false']) as running, \
            browser() as chromium:
        wait_until(log_has(running['dashboard'], 'ready:'), 'page')
        page = chromium.new_page()
        page.goto(url_of(running['dashboard']))
        first = wait_until(lambda: page.locator('.picture img').count() and source_of(page),
                           'picture')
        assert first.startswith('data:image/jpeg;base64,')
        wait_until(lambda: source_of(page) != first, 'next picture')
        page.get_by_test_id('picture-switch').click()
        page.locator('.picture').wait_for(state='hidden')


def test_without_pictures_there_is_no_panel(domain, tmp_path):
    with running_dashboard(tmp_path) as (_, url), browser() as chromium:
        page = open_page(chromium, url)
        assert not page.get_by_test_id('picture-switch').is_visible()
