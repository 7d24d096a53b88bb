# SPDX-License-Identifier: Apache-2.0
"""The page in a real browser."""

import re
import urllib.error
import urllib.request

from browser import browser, drag, open_page, running_dashboard, text_of, url_of, wait_for
from node_processes import log_has, nodes, run
import pytest
from waiting import wait_until

from comply_ros.mentor.policy_text import parse_policy
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World

WORLD = World(read_map('bar_grid', 'published'))
GRID = WORLD.grid


@pytest.fixture
def chromium():
    with browser() as chromium:
        yield chromium


def iteration(page):
    """Return the number and the mean return of the last iteration on the page."""
    match = wait_for(page, 'progress', r'iteration (\d+): mean return (\S+\d)')
    return int(match[1]), float(match[2])


def arrows(page):
    """Return the number of the mentor's arrows in the picture."""
    return page.evaluate("""() => [...document.querySelectorAll('.world path[fill]')].map(
        path => path.getAttribute('d').split('M').length - 1).reduce((a, b) => a + b, 0)""")


def saved_policy(page):
    """Return the text of the policy file that the page saves."""
    with page.expect_download() as download:
        page.get_by_test_id('save').click()
    return download.value.path().read_text()


def test_a_policy_is_painted_and_the_learning_curve_rises(domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (_, url):
        page = open_page(chromium, url)
        first, low = iteration(page)
        drag(page, GRID, (0, 0), (10, 0), (10, 9))
        wait_for(page, 'reference-returns', 'mentor alone')
        wait_until(lambda: arrows(page) == 20, 'arrows along the way')
        for x in range(10):
            drag(page, GRID, (x, 1), (x, 0))
        wait_for(page, 'trust', r'trust in you 0\.\d\d')
        wait_until(lambda: iteration(page)[0] >= first + 15 and iteration(page)[1] > low + 1.0,
                   'rise of the curve')


def test_an_alarm_is_shown_while_the_learner_is_lost(domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (running, url):
        page = open_page(chromium, url)
        wait_for(page, 'run-state', 'running')
        place = page.locator('.world').first.bounding_box()
        running['learner'].kill()
        wait_for(page, 'alarm', r'The learner has sent no status for \d+ s')
        wait_for(page, 'health-learner', 'lost: no status')
        assert text_of(page, 'run-state') == 'stopped'
        assert page.locator('.world').first.bounding_box() == place
        running['learner'].start()
        wait_for(page, 'run-state', 'running')
        wait_until(lambda: not page.get_by_test_id('alarm').is_visible(), 'end of the alarm')


def test_a_page_that_is_opened_later_shows_all_that_was_painted(
        domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (_, url):
        page = open_page(chromium, url)
        drag(page, GRID, (0, 0), (8, 0))
        wait_until(lambda: arrows(page) == 9, 'painted arrows')
        reached, _ = iteration(page)
        page.reload()
        page.locator('.world').first.wait_for()
        other = open_page(chromium, url)
        for each in (page, other):
            wait_until(lambda: arrows(each) == 9, 'painted arrows')
            assert iteration(each)[0] >= reached
        drag(other, GRID, (0, 2), (2, 2))
        wait_until(lambda: arrows(page) == 12, 'what was painted on the other page')


def test_the_run_pauses_steps_and_is_reset(domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (_, url):
        page = open_page(chromium, url)
        iteration(page)
        page.get_by_test_id('pause').click()
        wait_for(page, 'run-state', 'paused')
        before = wait_for(page, 'step-id', r'episode (\d+), step (\d+)')
        page.get_by_test_id('step').click()
        wait_until(lambda: text_of(page, 'step-id') != before[0], 'step')
        page.get_by_test_id('reset').click()
        page.get_by_test_id('confirm-reset').click()
        wait_for(page, 'progress', 'No iteration')
        assert text_of(page, 'step-id') == '' and text_of(page, 'run-state') == 'paused'
        page.get_by_test_id('step').click()
        wait_for(page, 'step-id', 'episode 1, step 0')
        page.get_by_test_id('pause').click()
        wait_for(page, 'run-state', 'running')


def test_the_speed_and_parameters_of_the_learner_change_while_it_runs(domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (_, url):
        page = open_page(chromium, url)
        wait_for(page, 'speed-text', '300 steps per second')
        slider = page.get_by_test_id('speed').locator('[tabindex]')
        for _ in range(3):
            slider.press('ArrowRight')
        wait_for(page, 'speed-text', 'as fast as possible')
        for _ in range(3):  # which leaves time for the browser
            slider.press('ArrowLeft')
        wait_for(page, 'speed-text', r'\d+ steps per second')
        page.get_by_test_id('parameters').get_by_text("Learner's parameters").click()
        discount = page.get_by_label('discount', exact=True)
        discount.fill('0.9')
        discount.press('Enter')
        other = open_page(chromium, url)
        other.get_by_test_id('parameters').get_by_text("Learner's parameters").click()
        wait_until(lambda: other.get_by_label('discount', exact=True).input_value() == '0.9',
                   'discount on the other page')
        discount.fill('7')
        discount.press('Enter')
        page.get_by_text(re.compile('discount.*7')).first.wait_for()
        wait_until(lambda: discount.input_value() == '0.9', 'the value that holds')


def test_policies_are_generated_spoiled_erased_saved_and_loaded(domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (_, url):
        page = open_page(chromium, url)
        page.get_by_test_id('generate').click()
        wait_until(lambda: arrows(page) == WORLD.free.sum(), 'generated mentor')
        made = saved_policy(page)
        page.get_by_test_id('spoil').click()
        wait_until(lambda: saved_policy(page) != made, 'spoiled policy')
        parse_policy(saved_policy(page), WORLD)
        page.get_by_test_id('clear').click()
        wait_until(lambda: arrows(page) == 0, 'empty policy')
        (tmp_path / 'mine.txt').write_text(made)
        (tmp_path / 'wrong.txt').write_text('<<<\n')
        for name in ('wrong.txt', 'mine.txt'):
            page.locator('input[type=file]').set_input_files(tmp_path / name)
            if name == 'wrong.txt':
                page.get_by_text('wrong.txt: a policy must have a row for each').wait_for()
        wait_until(lambda: saved_policy(page) == made, 'loaded policy')


def test_the_robot_is_steered_with_the_arrow_keys(domain, tmp_path, chromium):
    with running_dashboard(tmp_path, '-p', 'patience:=20.0', remembers='false') as (_, url):
        page = open_page(chromium, url)
        page.get_by_text('steer with the arrow keys').click()
        page.locator('.waits').wait_for(state='attached')
        page.wait_for_timeout(500)  # the page shows what was 0.1 s ago
        before = text_of(page, 'step-id')
        page.wait_for_timeout(500)
        assert text_of(page, 'step-id') == before
        wait_until(lambda: (page.keyboard.press('ArrowUp'), page.keyboard.press('ArrowRight'),
                            arrows(page) > 2)[-1], 'arrows where it was steered')


def test_the_page_asks_for_the_token_where_other_machines_reach_it(
        domain, tmp_path, chromium, monkeypatch):
    monkeypatch.setenv('COMPLY_ROS_TOKEN', 'open-sesame')
    with nodes(tmp_path, grid_world=['-p', 'map:=bar_grid'], dashboard=[
            '-p', 'address:=0.0.0.0', '-p', 'port:=0']) as running:
        wait_until(log_has(running['dashboard'], 'ready:'), 'page')
        port = re.search(r':(\d+)/', url_of(running['dashboard']))[1]
        for path in ('', '_nicegui_ws/socket.io/?EIO=4&transport=polling', '?token=wrong'):
            with pytest.raises(urllib.error.HTTPError, match='401'):
                urllib.request.urlopen(f'http://127.0.0.1:{port}/{path}')
        page = chromium.new_page()
        page.goto(f'http://127.0.0.1:{port}/')
        page.get_by_label('Token').fill('not this')
        page.get_by_role('button').click()
        page.get_by_text('This is not the token.').wait_for()
        page.get_by_label('Token').fill('open-sesame')
        page.get_by_role('button').click()
        page.locator('.world').first.wait_for()


def test_without_a_human_mentor_the_page_has_no_paint_tools(domain, tmp_path, chromium):
    mentor = ['-p', 'mentor:=optimal']
    with running_dashboard(tmp_path, '-p', 'teach:=false', mentor=mentor) as (_, url):
        page = open_page(chromium, url)
        wait_until(lambda: arrows(page) > 0, "the mentor's arrows")
        assert page.get_by_test_id('tools').count() == 0


@pytest.mark.parametrize('argument, sentence', [
    ('port:=70000', 'parameter port must lie in [0, 65535], got 70000'),
    ('token:=open-sesame', 'parameter token must not be given'),
    ('address:=203.0.113.1', 'parameters address and port must be free to listen on')])
def test_an_invalid_address_port_or_token_is_reported_in_one_line(domain, argument, sentence):
    done = run('dashboard', '--ros-args', '-p', argument)
    assert done.returncode == 2
    assert done.stderr.startswith(f'dashboard: {sentence}') and done.stderr.count('\n') == 1
