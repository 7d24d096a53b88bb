# SPDX-License-Identifier: Apache-2.0
"""The page of the suite, from invented numbers."""

from pathlib import Path

import pytest

from comply_ros.experiments import suite_page
from comply_ros.experiments.suite_page import NO_GYMNASIUM, page_lines
from comply_ros.experiments.suite_runs import BASELINES, MENTORS


def around(mean, half=0.0):
    """Return a mean with an interval."""
    return {'mean': mean, 'low': mean - half, 'high': mean + half}


def world(name, held_out, broken=(), clear=()):
    """Return the numbers of a world in which some rules do not hold."""
    rules = (*MENTORS, 'alone')
    return {'map': name, 'held_out': held_out, 'states': 50, 'best': 'watkins',
            'regret': {'none': around(100.0, 4.0), **dict.fromkeys(MENTORS, around(90.0, 2.0)),
                       **dict.fromkeys(BASELINES, around(310.4))},
            'holds': {rule: rule not in broken for rule in rules},
            'clear': {rule: rule in clear for rule in rules}}


def page(**changes):
    """Return the page of three worlds as a text."""
    numbers = {'profile': 'published', 'seeds': 3, 'mountain_car': None, 'worlds': [
        world('free_grid', True), world('maze', False, broken=['random']),
        world('garnet:12', True, broken=['optimal', 'alone'], clear=['alone'])]}
    return '\n'.join(page_lines({**numbers, **changes}, 'figures/suite.png'))


@pytest.mark.parametrize('row', [
    '| 1: any mentor | 1 of 3 | 0 of 1 | 1 of 2 | 0 |',
    '| 1: optimal | 2 of 3 | 1 of 1 | 1 of 2 | 0 |',
    '| 1: random | 2 of 3 | 0 of 1 | 2 of 2 | 0 |',
    '| 2: without a mentor | 2 of 3 | 1 of 1 | 1 of 2 | 1 |'])
def test_a_rule_is_counted_in_the_worlds_looked_at_and_in_those_held_out(row):
    assert row in page()


def test_a_rule_is_kept_if_it_holds_in_enough_worlds():
    assert ('Rule 1 is **not** kept (1 of 3 worlds). Rule 2 is **not** kept (2 of 3 worlds).'
            in page())
    kept = [world('maze', False)] * 9
    assert 'Rule 1 is kept (9 of 9 worlds). Rule 2 is kept (9 of 9 worlds).' in page(worlds=kept)
    worlds = [*kept, world('windy', True, broken=['alone'])]
    assert 'Rule 1 is kept (10 of 10 worlds). Rule 2 is kept (9 of 10 worlds).' in page(
        worlds=worlds)


def test_a_row_has_the_regrets_and_marks_what_breaks_a_rule():
    text = page()
    assert ('| `free_grid` | yes | 50 | 100 ± 4 | 90 ± 2 | 90 ± 2 | 90 ± 2 | 90 ± 2 | 90 ± 2 '
            '| 310 (`watkins`) |') in text
    assert '| `maze` |  | 50 | 100 ± 4 | 90 ± 2 | 90 ± 2 | 90 ± 2 | **90 ± 2** |' in text
    assert '| `garnet:12` | yes | 50 | **100 ± 4** ! | **90 ± 2** |' in text


def test_the_maps_that_were_held_out_are_named():
    text = page()
    assert 'in alphabetical order (`free_grid`), and `garnet:10` to `garnet:19`, but for' in text
    assert '`cliff_walking`, ' in text and '`windy` and `garnet:15`' in text
    assert '](figures/suite.png)' in page()


def test_the_car_is_left_out_with_a_line_that_says_why():
    assert NO_GYMNASIUM in page()
    text = page(mountain_car={'none': around(-150.0, 5.0), 'swing': around(-120.0),
                              'watkins': around(-200.0)})
    assert NO_GYMNASIUM not in text
    assert '| `model_based` | none | -150 ± 5 |' in text
    assert '| `model_based` | swing | -120 ± 0 |' in text
    assert '| `watkins` | none | -200 ± 0 |' in text


def test_the_parts_are_there_if_they_were_computed():
    assert 'each part' not in page() and '--ablations' not in page()
    text = page(ablations={'0.7': {'the mentor is not heard': {'none': around(450.0, 9.0)}}})
    assert '--suite --seeds 3 --ablations`' in text
    assert 'with probability 0.7:' in text
    assert '| the mentor is not heard | 450 ± 9 | - | - | - | - | - |' in text


def test_the_stored_page_has_the_current_text():
    stored = (Path(__file__).parents[2] / 'docs' / 'results' / 'suite.md').read_text()
    assert stored.startswith(suite_page.TITLE + '\n')
    for text in (suite_page.WORLDS, suite_page.PARTS,
                 suite_page.INTRODUCTION.partition('**Held out**')[2].partition('{')[0]):
        assert text in stored
