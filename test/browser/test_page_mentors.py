# SPDX-License-Identifier: Apache-2.0
"""Who is the mentor on the page, and what it says about a second one and about ended nodes."""

from argparse import Namespace
import os
import re
import signal
import subprocess
import sys

from browser import browser, drag, running_dashboard, text_of, url_of, wait_for
from node_processes import log_has, nodes, ROOT
import pytest
from ros_client import ros_client
from short_training import children
from waiting import DEADLINE, wait_until

from comply_ros.nodes.node_processes import START
from comply_ros.nodes.topics import RECOMMENDATION
from comply_ros.plots.mentor_marks import mentor_color
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World

RANDOM = ('-p', 'mentor:=random')
GRID = World(read_map('bar_grid', 'published')).grid


@pytest.fixture
def chromium():
    with browser() as chromium:
        yield chromium


@pytest.fixture
def client(domain):
    with ros_client() as client:
        yield client


def open_page(chromium, url):
    """Return a page of the browser, whatever it shows."""
    page = chromium.new_page()
    page.set_default_timeout(DEADLINE * 1000)
    page.goto(url)
    return page


def test_the_page_watches_while_another_mentor_is_heard(client, tmp_path, chromium):
    with running_dashboard(tmp_path, mentor=RANDOM) as (running, url):
        wait_until(log_has(running['mentor'], 'ready'), 'mentor')
        page = open_page(chromium, url)
        page.get_by_test_id('take-over').wait_for()
        assert page.get_by_test_id('tools').count() == 0
        wait_until(lambda: client.count_publishers(RECOMMENDATION.name) == 1,
                   'the mentor, found by the client too, and no other publisher')
        page.get_by_test_id('take-over').click()
        page.get_by_test_id('tools').wait_for()
        wait_for(page, 'alarm', '2 mentors speak: the learner uses the advice of all')
        running['mentor'].interrupt()
        wait_until(lambda: '2 mentors' not in page.get_by_test_id('alarm').inner_text(),
                   'end of the alarm')


def groups(page):
    """Return the colors of the groups of arrows of several mentors."""
    return page.evaluate("""() => [...document.querySelectorAll('.world g.mentor')].map(
        each => each.getAttribute('color'))""")


def test_each_of_several_mentors_has_its_arrows_and_can_be_chosen(domain, tmp_path, chromium):
    with nodes(tmp_path / 'anna', mentor=('-p', 'mentor:=optimal', '-p', 'name:=anna')), \
            nodes(tmp_path / 'bob', mentor=(*RANDOM, '-p', 'name:=bob')), \
            running_dashboard(tmp_path, '-p', 'teach:=false') as (_, url):
        page = open_page(chromium, url)
        wait_for(page, 'mentors', r'(?s)all.*anna.*\d\.\d\d.*bob.*\d\.\d\d')
        wait_until(lambda: groups(page) == [mentor_color(0), mentor_color(1)], 'arrows of both')
        page.set_viewport_size({'width': 360, 'height': 740})
        assert page.evaluate('document.documentElement.scrollWidth') == 360
        page.get_by_test_id('mentor-bob').click()
        wait_until(lambda: groups(page) == [], 'arrows of one')
        assert page.get_by_test_id('mentor-bob').get_attribute('aria-pressed') == 'true'
        page.get_by_test_id('all-mentors').click()
        wait_until(lambda: len(groups(page)) == 2, 'arrows of both again')
        assert not page.get_by_test_id('alarm').is_visible()


def test_a_person_teaches_beside_mentors_with_names_and_the_learner_goes_on_after_it(
        domain, tmp_path, chromium):
    with nodes(tmp_path / 'anna', mentor=('-p', 'mentor:=optimal', '-p', 'name:=anna')), \
            nodes(tmp_path / 'bob', mentor=(*RANDOM, '-p', 'name:=bob')), \
            running_dashboard(tmp_path, remembers='false') as (running, url):
        page = open_page(chromium, url)
        wait_for(page, 'offer', '2 mentors advise, and you watch')
        assert page.get_by_test_id('tools').count() == 0
        page.get_by_test_id('take-over').click()
        page.get_by_test_id('tools').wait_for()
        assert text_of(page, 'own-name') == 'person'
        wait_until(log_has(running['dashboard'], 'follows world'), 'world to paint in')
        wait_until(lambda: 'takes the advice of person too' in running['learner'].log.read_text(),
                   'place at the learner')
        page.wait_for_function('() => window.did_handshake')
        wait_until(lambda: not page.get_by_test_id('joining').is_visible(), 'no sentence on it')
        drag(page, GRID, (0, 0), (10, 0), (10, 9))
        wait_until(lambda: groups(page) == [*map(mentor_color, range(3))], 'arrows of all three')
        wait_for(page, 'trust', r'trust in you \d\.\d\d')
        wait_for(page, 'mentors', r'(?s)anna.*bob.*person\s+\d\.\d\d')
        page.set_viewport_size({'width': 390, 'height': 844})
        assert page.evaluate('document.documentElement.scrollWidth') == 390
        running['dashboard'].interrupt()
        running['dashboard'].wait()
        with nodes(tmp_path / 'other', dashboard=('-p', 'port:=0', '-p', 'teach:=false')) as other:
            wait_until(log_has(other['dashboard'], 'ready:'), 'page')
            page = open_page(chromium, url_of(other['dashboard']))
            first = wait_for(page, 'progress', r'iteration (\d+)')[1]
            wait_until(lambda: int(re.search(r'iteration (\d+)', text_of(page, 'progress'))[1])
                       > int(first) + 3, 'iterations without the person')
            assert not page.get_by_test_id('offer').is_visible()


def test_a_page_that_nobody_has_used_gives_way_to_a_mentor(client, tmp_path, chromium):
    with running_dashboard(tmp_path) as (_, url):
        page = open_page(chromium, url)
        page.get_by_test_id('tools').wait_for()
        with nodes(tmp_path / 'other', mentor=RANDOM):
            page.get_by_test_id('take-over').wait_for()
            client.until(lambda: client.count_publishers(RECOMMENDATION.name) == 1, 'one mentor')
        page.get_by_test_id('tools').wait_for()


def test_a_page_that_is_used_stays_beside_a_mentor(domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (running, url):
        page = open_page(chromium, url)
        wait_until(log_has(running['dashboard'], 'follows world'), 'world to paint in')
        page.get_by_test_id('generate').click()
        with nodes(tmp_path / 'other', mentor=RANDOM):
            wait_for(page, 'alarm', '2 mentors speak')
            assert page.get_by_test_id('tools').count() == 1


@pytest.mark.parametrize('name', ['grid_world', 'learner'])
def test_the_demo_names_a_node_that_ended_and_starts_it_again(domain, tmp_path, chromium, name):
    log = tmp_path / 'demo.log'
    with log.open('wb') as output:
        demo = subprocess.Popen(
            [sys.executable, '-c', START.format('demo'), '--teach', '--port', '0', '--out',
             str(tmp_path)], cwd=ROOT, stdout=output, stderr=subprocess.STDOUT)
    try:
        wait_until(lambda: 'ready:' in log.read_text(), 'page')
        url = url_of(Namespace(log=log))
        assert url in log.read_text().splitlines()  # a narrow terminal does not break it
        page = open_page(chromium, url)
        page.locator('.world').first.wait_for()
        os.kill(children(demo)[name], signal.SIGKILL)
        wait_for(page, 'alarm', f'{name} ended with signal SIGKILL; its last lines:')
        wait_for(page, 'alarm', 'ready')
        assert f'{name} ended with signal SIGKILL' in log.read_text()
        page.get_by_test_id('start-again').click()
        wait_for(page, 'run-state', 'running')
        wait_until(lambda: not page.get_by_test_id('start-again').is_visible(), 'end of the alarm')
    finally:
        demo.send_signal(signal.SIGINT)
        demo.wait(DEADLINE)
