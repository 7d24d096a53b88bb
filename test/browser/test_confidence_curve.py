# SPDX-License-Identifier: Apache-2.0
"""The confidence in each mentor as lines, and the chart of them on the page."""

from math import nan

from browser import browser, open_page, running_dashboard
from node_processes import nodes
import pytest
from waiting import wait_until

from comply_ros.dashboard.confidence_panel import (
    confidence_curves,
    confidence_options,
    MOST_POINTS,
    points_of,
)
from comply_ros.plots.mentor_marks import mentor_color
from comply_ros.protocol.iteration_curve import IterationCurve
from comply_ros.protocol.run_reports import RunReports


def test_each_mentor_has_a_line_in_its_color_with_a_gap_where_it_gave_no_advice():
    options = confidence_options({'anna': IterationCurve((1, 2, 3), (0.5, nan, 0.75)),
                                  'bob': IterationCurve((12,), (0.25,))})
    anna, bob = options['series']
    assert anna['data'] == [[1, 0.5], [2, None], [3, 0.75]]
    assert [anna['itemStyle']['color'], bob['itemStyle']['color']] == [
        mentor_color(0), mentor_color(1)]
    assert (anna['showSymbol'], bob['showSymbol']) == (False, True)  # of one point
    assert options['legend']['data'] == ['anna', 'bob']
    assert (options['xAxis']['max'], options['yAxis']['max']) == (12, 1)


def test_the_only_mentor_has_a_name_on_the_page():
    assert list(confidence_curves(RunReports())) == ['mentor']


@pytest.mark.parametrize('count, shown', [
    (1, 1), (MOST_POINTS, MOST_POINTS), (MOST_POINTS + 1, MOST_POINTS // 2 + 1)])
def test_a_long_line_is_thinned_out_to_its_newest_point(count, shown):
    curve = IterationCurve(tuple(range(1, count + 1)), count * (0.5,))
    assert len(points_of(curve)) == shown <= MOST_POINTS
    assert points_of(curve)[-1] == (count, 0.5)


@pytest.fixture
def chromium():
    with browser() as chromium:
        yield chromium


def stroke_colors(page):
    """Return the colors of the thick lines of the chart."""
    return page.evaluate("""() => [...document.querySelectorAll(
        '[data-testid=confidence] svg path[stroke-width="2"]')].map(
        each => each.getAttribute('stroke').toUpperCase())""")


def test_the_page_has_a_line_for_each_mentor_and_is_as_wide_as_a_phone(
        domain, tmp_path, chromium):
    with running_dashboard(tmp_path, '-p', 'teach:=false') as (_, url):
        page = open_page(chromium, url)
        assert not page.get_by_test_id('confidence').is_visible()  # nobody advises yet
        with nodes(tmp_path / 'anna', mentor=('-p', 'mentor:=optimal', '-p', 'name:=anna')), \
                nodes(tmp_path / 'bob', mentor=('-p', 'mentor:=random', '-p', 'name:=bob')):
            colors = [mentor_color(0), mentor_color(1)]
            wait_until(lambda: [each for each in stroke_colors(page) if each in colors] == colors,
                       'a line for each mentor')
            panel = page.get_by_test_id('confidence')
            assert 'CONFIDENCE IN EACH MENTOR' in panel.inner_text().upper()
            assert all(name in panel.inner_html() for name in ('anna', 'bob'))
            page.set_viewport_size({'width': 390, 'height': 844})
            wait_until(lambda: panel.locator('svg').bounding_box()['width'] < 390, 'narrow chart')
            assert page.evaluate('document.documentElement.scrollWidth') == 390


def test_the_page_has_the_line_of_the_only_mentor(domain, tmp_path, chromium):
    with nodes(tmp_path / 'mentor', mentor=('-p', 'mentor:=optimal')), \
            running_dashboard(tmp_path, '-p', 'teach:=false') as (_, url):
        page = open_page(chromium, url)
        wait_until(lambda: mentor_color(0) in stroke_colors(page), 'its line')
        text = page.get_by_test_id('confidence').inner_text().upper()
        assert 'CONFIDENCE IN THE MENTOR' in text
