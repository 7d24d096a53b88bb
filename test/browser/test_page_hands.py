# SPDX-License-Identifier: Apache-2.0
"""Touch, keys and colours of the page, in a real browser."""

from browser import browser, drag, open_page, running_dashboard, text_of
import pytest
from waiting import wait_until

from comply_ros.storage.map_files import read_map

GRID = read_map('bar_grid', 'published')
ARROWS = """() => [...document.querySelectorAll('.world path[fill], .world path.unknown')].map(
    path => path.getAttribute('d').split('M').length - 1).reduce((a, b) => a + b, 0)"""
# Where the picture is while the step id is short and while it is long.
PLACES = """() => ['episode 1, step 0', 'episode 123456789, step 123456789'].map(text => {
  document.querySelector('[data-testid=step-id]').textContent = text;
  return document.querySelector('.world').getBoundingClientRect().top;
})"""
# Texts whose contrast with what is behind them is less than 4.5, by the formula of WCAG.
LOW_CONTRAST = """() => {
  const light = ([r, g, b]) => [r, g, b].map(c => c / 255).map(
      c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
      .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
  const canvas = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
  const over = (color, below, alpha) => {
    canvas.clearRect(0, 0, 1, 1);
    if (below) { canvas.fillStyle = `rgb(${below})`; canvas.fillRect(0, 0, 1, 1); }
    canvas.globalAlpha = alpha; canvas.fillStyle = color; canvas.fillRect(0, 0, 1, 1);
    canvas.globalAlpha = 1;
    return [...canvas.getImageData(0, 0, 1, 1).data.slice(0, 3)];
  };
  const found = [];
  for (const element of document.querySelectorAll('body *')) {
    const own = [...element.childNodes].some(n => n.nodeType === 3 && n.textContent.trim());
    if (!own && !(element instanceof HTMLInputElement) || !element.checkVisibility(
        {checkOpacity: true, checkVisibilityCSS: true})) continue;
    if (element.closest('style, script, [disabled], .disabled, .q-icon, #popup, ' +
                        '.nicegui-error-popup')) continue;
    const chain = [];
    for (let each = element; each; each = each.parentElement) chain.unshift(each);
    let below = [255, 255, 255], alpha = 1;
    for (const each of chain) {
      const style = getComputedStyle(each);
      alpha *= Number(style.opacity);
      below = over(style.backgroundColor, below, 1);
    }
    const style = getComputedStyle(element);
    const ink = element instanceof SVGElement ? style.fill : style.color;
    const [a, b] = [light(over(ink, below, alpha)), light(below)].sort((x, y) => y - x);
    const contrast = (a + 0.05) / (b + 0.05);
    if (contrast < 4.5) found.push(`${contrast.toFixed(2)} ${element.className.baseVal ??
        element.className}: ${element.textContent.trim().slice(0, 40)}`);
  }
  return found;
}"""


@pytest.fixture
def chromium():
    with browser() as chromium:
        yield chromium


class Finger:
    """Touches a page, with as many fingers as points are given."""

    def __init__(self, page):
        self._session = page.context.new_cdp_session(page)

    def __call__(self, kind, *points):
        self._session.send('Input.dispatchTouchEvent', {'type': f'touch{kind}', 'touchPoints': [
            {'x': x, 'y': y, 'id': number} for number, (x, y) in enumerate(points)]})


def cell(page, x, y):
    """Return the middle of a cell on the screen, (0, 0) at the lower left."""
    box = page.locator('.world').first.bounding_box()
    side = box['width'] / GRID.width
    return box['x'] + (x + 0.5) * side, box['y'] + (GRID.height - y - 0.5) * side


def test_one_finger_paints_and_two_fingers_scroll_the_page(domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (_, url):
        page = open_page(chromium, url, has_touch=True, is_mobile=True)
        page.set_viewport_size({'width': 390, 'height': 844})
        wait_until(lambda: page.locator('.world').first.bounding_box()['width'] < 390, 'layout')
        short, long = page.evaluate(PLACES)
        assert short == long
        finger = Finger(page)
        finger('Start', cell(page, 0, 0))
        for x in range(1, 9):
            finger('Move', cell(page, x, 0))
        finger('End')
        wait_until(lambda: page.evaluate(ARROWS) == 9, 'painted arrows')
        assert page.evaluate('scrollY') == 0
        page.screenshot(path=tmp_path / 'phone.png')
        (x, y), (x2, y2) = cell(page, 2, 0), cell(page, 8, 0)
        finger('Start', (x, y), (x2, y2))
        for way in range(10, 200, 10):
            finger('Move', (x, y - way), (x2, y2 - way))
        finger('End')
        wait_until(lambda: page.evaluate('scrollY') > 50, 'scrolled page')
        assert page.evaluate(ARROWS) == 9


def test_what_is_painted_is_there_after_the_page_was_killed(domain, tmp_path, chromium):
    with running_dashboard(tmp_path, '-p', f'state_dir:={tmp_path / "state"}') as (running, url):
        page = open_page(chromium, url)
        drag(page, GRID, (0, 0), (8, 0))
        wait_until(lambda: page.evaluate(ARROWS) == 9, 'painted arrows')
        wait_until(lambda: '>>>>>>>>>' in ''.join(
            file.read_text() for file in (tmp_path / 'state').glob('*.txt')), 'stored painting')
        running['dashboard'].kill()
        running['dashboard'].wait()
        log = running['dashboard'].log
        log.write_text('')
        running['dashboard'].start()
        wait_until(lambda: 'ready:' in log.read_text(), 'page')
        page = open_page(chromium, log.read_text().split('ready:')[1].split()[0])
        wait_until(lambda: page.evaluate(ARROWS) == 9, 'arrows of before')


def test_while_steering_keys_steer_and_do_nothing_else_until_the_page_is_gone(
        domain, tmp_path, chromium):
    with running_dashboard(tmp_path, '-p', 'patience:=60.0', remembers='false') as (_, url):
        page, other = open_page(chromium, url), open_page(chromium, url)
        page.set_viewport_size({'width': 600, 'height': 400})
        page.get_by_text('steer with the arrow keys').click()
        page.locator('[data-steering=true]').wait_for(state='attached')
        before = page.evaluate('scrollY'), text_of(page, 'speed-text')
        page.get_by_test_id('speed').locator('[tabindex]').focus()
        scrolled = page.evaluate('scrollY')
        wait_until(lambda: (page.keyboard.press('ArrowUp'), page.keyboard.press('ArrowRight'),
                            page.evaluate(ARROWS) > 2)[-1], 'arrows where it was steered')
        assert (page.evaluate('scrollY'), text_of(page, 'speed-text')) == (scrolled, before[1])
        switch = page.get_by_test_id('steering')
        page.evaluate('document.activeElement.blur()')
        page.keyboard.press('Space')
        assert page.evaluate('scrollY') == scrolled
        assert switch.get_attribute('aria-checked') == 'true'
        assert other.get_by_test_id('steering').get_attribute('aria-checked') == 'true'
        page.close()
        wait_until(lambda: other.get_by_test_id('steering').get_attribute(
            'aria-checked') == 'false', 'end of steering')


def test_a_click_leaves_the_steering_switch_so_that_space_does_not_switch_it_off(
        domain, tmp_path, chromium):
    with running_dashboard(tmp_path, '-p', 'patience:=60.0', remembers='false') as (_, url):
        page = open_page(chromium, url)
        page.get_by_text('steer with the arrow keys').click()
        page.locator('[data-steering=true]').wait_for(state='attached')
        page.keyboard.press('Space')
        page.get_by_test_id('generate').hover()
        assert page.get_by_test_id('steering').get_attribute('aria-checked') == 'true'
        page.locator('[data-steering=true]').wait_for(state='attached')


def test_every_text_can_be_read_in_light_and_dark(domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (_, url):
        page = open_page(chromium, url)
        page.get_by_test_id('parameters').get_by_text("Learner's parameters").click()
        page.get_by_label('discount', exact=True).wait_for()
        drag(page, GRID, (0, 0), (8, 0))
        for mode in 'light', 'dark':
            page.emulate_media(color_scheme=mode)
            page.locator(f'.body--{mode}').wait_for()
            page.screenshot(path=tmp_path / f'{mode}.png', full_page=True)
            wait_until(lambda: page.evaluate(LOW_CONTRAST) == [] or (
                print(page.evaluate(LOW_CONTRAST)), False)[1], 'readable texts', 20.0)


def test_each_kind_of_mentor_has_a_labelled_number_of_its_own(domain, tmp_path, chromium):
    with running_dashboard(tmp_path) as (_, url):
        page = open_page(chromium, url)
        for kind, label, value in (('noisy', 'random share', '0.2'),
                                   ('snapshot', 'quality', '0.75')):
            page.get_by_test_id('kind').click()
            page.get_by_role('option', name=kind).click()
            field = page.get_by_label(label)
            field.wait_for()
            assert field.input_value() == value
        page.get_by_test_id('kind').click()
        page.get_by_role('option', name='optimal').click()
        page.get_by_label('quality').wait_for(state='hidden')
