# SPDX-License-Identifier: Apache-2.0
"""From the command to figures, numbers and a page, on the small grids."""

import json
import resource
import signal
import subprocess
import sys

import pytest
from waiting import DEADLINE, wait_until

from comply_ros.experiments import reproduce
from comply_ros.experiments.line_styles import COLOURS
from comply_ros.experiments.report_figures import Figure
from comply_ros.experiments.training_runs import Run

FIGURES = ('2.1', '2.4', '2.6', '2.7', '2.8', '3.10')
COMMAND = [sys.executable, '-c', 'from comply_ros.executables import reproduce; '
           'raise SystemExit(reproduce())']


def reproduced(folder, *argv):
    """Return the exit code of `reproduce` with two seeds into a folder."""
    return reproduce.main(['reproduce', '--seeds', '2', '--out', str(folder), *argv])


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    """Return a folder with some figures."""
    folder = tmp_path_factory.mktemp('reproduced')
    assert reproduced(folder, '--figures', *FIGURES) == 0
    return folder


def test_figures_numbers_and_a_page_are_written(whole):
    assert {path.stem for path in (whole / 'figures').iterdir()} == set(FIGURES)
    numbers = json.loads((whole / 'results.json').read_text())
    assert set(numbers['figures']) == set(FIGURES)
    (name, cell), = numbers['cells'].items()
    assert name.startswith('free_grid, published, sarsa, temperature=2.0')
    assert (cell['seeds'], len(cell['mean'])) == (2, 599)
    assert cell['regret']['low'] <= cell['regret']['mean'] <= cell['regret']['high']
    page = (whole / 'results.md').read_text()
    for figure in FIGURES:
        assert f'(figures/{figure}.png)' in page
    assert page.count('The report: ') == len(FIGURES)


def test_pictures_have_the_size_of_the_page(whole):
    for figure in FIGURES:
        header = (whole / 'figures' / f'{figure}.png').read_bytes()[:24]
        assert header[:4] == b'\x89PNG'
        assert 500 <= int.from_bytes(header[16:20], 'big') <= 1500


@pytest.mark.long
def test_a_second_run_computes_nothing(whole):
    before = {path: path.stat().st_mtime_ns for path in (whole / 'data').iterdir()}
    assert reproduced(whole, '--figures', *FIGURES) == 0
    assert {path: path.stat().st_mtime_ns for path in (whole / 'data').iterdir()} == before


def test_redraw_draws_without_computing(whole, tmp_path, capsys):
    (whole / 'figures' / '2.7.png').unlink()
    assert reproduced(whole, '--redraw', '--figures', '2.7') == 0
    assert (whole / 'figures' / '2.7.png').exists()
    assert reproduced(tmp_path, '--redraw', '--figures', '2.7') == 2
    assert f'--redraw must find all cells with 2 seeds in {tmp_path}/data, but 1 are missing' in (
        capsys.readouterr().err)


def test_a_page_elsewhere_has_its_pictures_beside_it(whole, tmp_path):
    page = tmp_path / 'docs' / 'results.md'
    assert reproduced(whole, '--figures', '2.1', '--page', str(page)) == 0
    assert '(results/2.1.png)' in page.read_text()
    assert (tmp_path / 'docs' / 'results' / '2.1.png').exists()


@pytest.mark.parametrize('argv, message', [
    (('--figures', '9.9'), 'reproduce: a figure must be one of 2.1, 2.2, '),
    (('--seeds', '0'), 'reproduce: seeds must be at least 1, got 0'),
    (('--profile', 'real'), "reproduce: profile must be one of report, published, got 'real'"),
    (('--mentors', '/nowhere'), "reproduce: a policy file must be readable, got '/nowhere/ment")])
def test_a_wrong_option_is_one_sentence(tmp_path, capsys, argv, message):
    assert reproduce.main(['reproduce', '--out', str(tmp_path), *argv]) == 2
    err = capsys.readouterr().err
    assert err.startswith(message) and err.count('\n') == 1


def test_an_interrupted_run_keeps_its_cells_and_is_continued(tmp_path):
    argv = [*COMMAND, '--figures', '2.8', '3.3', '--seeds', '3', '--out', str(tmp_path)]
    process = subprocess.Popen(argv, stderr=subprocess.PIPE, text=True)
    wait_until(lambda: list(tmp_path.glob('data/free_grid-*.npz')), 'first cell')
    process.send_signal(signal.SIGINT)
    assert process.wait(DEADLINE) == 130
    assert 'are kept in' in process.stderr.read().replace('\n', ' ')
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.glob('data/*.npz')}
    assert 1 <= len(kept) < 5 and not list(tmp_path.glob('data/*.part'))
    assert reproduced(tmp_path, '--figures', '2.8') == 0
    assert all(path.stat().st_mtime_ns == time for path, time in kept.items())


def test_two_cannot_run_in_the_same_folder(tmp_path, capsys):
    with reproduce.lock_folder(tmp_path):
        assert reproduced(tmp_path, '--figures', '2.1') == 2
    assert ('must be used by one reproduce at a time, and another one uses it'
            in capsys.readouterr().err)


@pytest.mark.long
def test_a_full_disk_is_one_sentence_and_keeps_the_cells(tmp_path, whole):
    argv = [*COMMAND, '--figures', '2.7', '2.10', '--seeds', '2', '--out', str(tmp_path)]
    limit = max(path.stat().st_size for path in (whole / 'data').iterdir()) - 100

    def no_room():
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    done = subprocess.run(argv, capture_output=True, text=True, preexec_fn=no_room, check=False)
    assert done.returncode == 1, done.stderr
    assert 'Traceback' not in done.stderr
    assert 'file too large' in done.stderr.splitlines()[-1]
    assert not list(tmp_path.glob('data/*.part'))


def test_an_exchange_of_the_mentor_has_a_picture_and_a_table(tmp_path, monkeypatch):
    run = Run('bar_grid', 'published', 'explicit', (('iterations', 6), ('episodes', 3)),
              'optimal + random')
    figure = Figure('mentor_exchange', 'An exchange', 'it is there', 'exchange',
                    {('explicit', 'optimal, then random'): run})
    monkeypatch.setattr(reproduce, 'report_figures', lambda profile, mentors: [])
    monkeypatch.setattr(reproduce, 'extra_figures', lambda profile, mentors: [figure])
    assert reproduced(tmp_path) == 0
    picture = (tmp_path / 'figures' / 'mentor_exchange.png').read_bytes()
    assert picture[:4] == b'\x89PNG' and len(picture) > 20_000
    (table,) = json.loads((tmp_path / 'results.json').read_text())[
        'figures']['mentor_exchange']['exchanges']
    confidence = table['confidence']
    assert confidence['before'] > confidence['after'] == confidence['end']  # three iterations
    page = (tmp_path / 'results.md').read_text()
    assert (f'| optimal, then random | `explicit` | {confidence["before"]:.2f} | '
            f'{confidence["after"]:.2f} |') in page


@pytest.mark.long
def test_every_kind_of_figure_of_a_compliant_learner_is_plotted(tmp_path, monkeypatch):
    run = Run('bar_grid', 'published', 'explicit', (('iterations', 4), ('episodes', 3)),
              'noisy:0.3')
    kinds = {'curves': {'explicit': run}, 'advice': {'mentor': run}, 'trust': {'explicit': run},
             'histogram': {'explicit': run},
             'regrets': {('explicit', 1.0): run, ('explicit', 0.5): run,
                         ('vanishing', None): run._replace(method='vanishing')},
             'time_to_convergence': {('explicit', 1.0): run},
             'together': {'explicit': run._replace(mentor='none')}, 'growth': {'sarsa': Run(
                 'bar_grid', 'published', 'sarsa', (('iterations', 20), ('episodes', 3)))}}
    figures = [Figure(kind, f'A figure of {kind}', 'it is there', kind, cells, 'bar_grid')
               for kind, cells in kinds.items()]
    monkeypatch.setattr(reproduce, 'report_figures', lambda profile, mentors: figures)
    monkeypatch.setattr(reproduce, 'extra_figures', lambda profile, mentors: [])
    assert reproduced(tmp_path) == 0
    assert {path.stem for path in (tmp_path / 'figures').iterdir()} == set(kinds)
    assert 'explicit' in COLOURS
