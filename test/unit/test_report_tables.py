# SPDX-License-Identifier: Apache-2.0
"""Tables of the page, from invented numbers."""

from pathlib import Path

from comply_ros.experiments import report_files, report_tables
from comply_ros.experiments.report_figures import fitted_run, Mentors
from comply_ros.experiments.report_tables import table_lines


def around(mean, half):
    """Return a mean with an interval."""
    return {'mean': mean, 'low': mean - half, 'high': mean + half}


def numbers(**cells):
    """Return numbers of a reproduction of one cell: vanishing with the optimal mentor."""
    name = fitted_run('vanishing', 'published', 'optimal').cell_name()
    cell = {'mean': [5.0] * 60, 'time_to_convergence': around(61.0, 2.0),
            'reward_ratio': around(0.65, 0.01), 'regret': around(315.0, 4.0), **cells}
    return {'profile': 'published', 'mentor_specs': list(Mentors()), 'cells': {name: cell},
            'mazes': {'maze': {'random_return': -71.57}, 'maze_as_run': {'random_return': -69.07}}}


def row(lines, begin):
    """Return the cells of the first row that begins like this."""
    line = next(each for each in lines if each.startswith(f'| {begin} |'))
    return [cell.strip() for cell in line.strip('|').split('|')]


def test_a_cell_is_beside_the_published_one():  # 61 is half of 122, 315 is 315
    assert row(list(table_lines(numbers())), 'vanishing | 100 %') == [
        'vanishing', '100 %', '122 / 0.65 / 315', '61 ± 2 / 0.65 ± 0.01 / 315 ± 4', '-50 %, 0 %',
        '-']


def test_a_missing_cell_or_number_is_a_dash():
    lines = list(table_lines(numbers(reward_ratio=None)))
    assert row(lines, 'vanishing | 100 %')[3] == '61 ± 2 / - / 315 ± 4'
    assert row(lines, 'explicit | 50 %')[2:] == ['209 / 0.09 / 1223', '-', '-', '-']


def test_a_number_that_rounds_to_0_has_no_sign():
    lines = list(table_lines(numbers(regret=around(-0.3, 0.2))))
    assert row(lines, 'vanishing | 100 %')[3].endswith('/ 0 ± 0')


def test_the_text_on_slips_has_the_computed_returns():
    text = ' '.join(table_lines(numbers())).replace('\n', ' ')
    assert 'at -69.1, has -69.07 with such slips' in text and '-71.57 where a slip' in text


def test_the_stored_page_has_the_current_text():
    page = (Path(__file__).parents[2] / 'docs' / 'results.md').read_text()
    for text in (report_files.DIFFERENCES, report_tables.PUBLISHED_SETTINGS, report_tables.TEXT,
                 report_tables.OUR_METHODS,
                 report_files.INTRODUCTION.partition('The metrics:')[2]):
        assert text in page
