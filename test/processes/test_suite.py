# SPDX-License-Identifier: Apache-2.0
"""`reproduce --suite`, in two small worlds and with one seed."""

import json

import pytest

from comply_ros.experiments import reproduce, suite
from comply_ros.experiments.suite_runs import SuiteWorld

pytestmark = pytest.mark.long  # it compiles code for three kinds of worlds
SHORT = (('iterations', 4), ('episodes', 2))
WORLDS = [SuiteWorld('bar_grid', False, SHORT), SuiteWorld('garnet:0', True, SHORT)]


@pytest.fixture(scope='module', autouse=True)
def small_suite():
    """Let the suite have two worlds, no parts, and no car."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(suite, 'suite_worlds', lambda: WORLDS)
        patch.setattr(suite, 'ablation_runs', lambda profile, folder: {
            (0.9, 'model_based', 'none'): WORLDS[0].runs(profile)['none']._replace(
                settings=(*SHORT, ('advice_slack', 0.0)))})
        patch.setattr(suite, 'find_spec', lambda name: None)
        yield


def run(folder, *argv):
    """Return the exit code of the suite with one seed into a folder."""
    return reproduce.main(['reproduce', '--suite', '--seeds', '1', '--out', str(folder), *argv])


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp('suite')
    assert run(folder) == 0
    return folder


def test_a_table_a_picture_and_numbers_are_written(whole):
    numbers = json.loads((whole / 'suite.json').read_text())
    assert [(world['map'], world['held_out']) for world in numbers['worlds']] == [
        ('bar_grid', False), ('garnet:0', True)]
    assert set(numbers['worlds'][1]['regret']) == {
        'none', 'optimal', 'noisy:0.3', 'snapshot:0.75', 'random', 'adversarial', 'q_learning',
        'watkins', 'sarsa_lambda'}
    page = (whole / 'suite.md').read_text()
    assert '| `garnet:0` | yes | 50 |' in page and '](figures/suite.png)' in page
    assert 'MountainCar is left out: it needs the Python package gymnasium' in page
    assert (whole / 'figures' / 'suite.png').read_bytes()[:4] == b'\x89PNG'


def test_a_second_run_computes_nothing_and_the_parts_are_added(whole, capsys):
    def times():
        return {path: path.stat().st_mtime_ns for path in (whole / 'data').iterdir()}
    before = times()
    assert run(whole, '--redraw') == 0
    assert times() == before and len(before) == 2 * 9
    assert run(whole, '--redraw', '--ablations') == 2
    assert f'with 1 seeds in {whole}/data, but 1 are missing' in capsys.readouterr().err
    assert run(whole, '--ablations') == 0
    assert before.items() < times().items()
    assert run(whole) == 0  # what was computed stays on the page
    assert '## What each part is worth' in (whole / 'suite.md').read_text()


def test_the_page_loses_no_other_page(whole, tmp_path, capsys):
    page = tmp_path / 'docs' / 'every.md'
    assert run(whole, '--page', str(page)) == 0
    assert '](every.png)' in page.read_text() and page.with_suffix('.png').exists()
    assert run(whole, '--page', str(page)) == 0  # it is its own
    other = tmp_path / 'results.md'
    other.write_text('# Results\n')
    assert run(whole, '--page', str(other)) == 2
    assert 'which would be lost' in capsys.readouterr().err
    assert other.read_text() == '# Results\n'


@pytest.mark.parametrize('argv, message', [
    (('--suite', '--figures', '2.1'), '--figures must not come with --suite, got both'),
    (('--suite', '--mentors', 'x'), '--mentors must not come with --suite, got both'),
    (('--ablations',), '--ablations must come with --suite, got it without'),
    (('--suite', '--seeds', '0'), 'seeds must be at least 1, got 0')])
def test_a_wrong_option_is_one_sentence(tmp_path, capsys, argv, message):
    assert reproduce.main(['reproduce', '--out', str(tmp_path), *argv]) == 2
    assert capsys.readouterr().err == f'reproduce: {message}\n'
