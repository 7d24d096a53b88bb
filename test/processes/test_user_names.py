# SPDX-License-Identifier: Apache-2.0
"""Names that a user chose are printed and drawn as they are: no language parses them."""

import json
import os
from pathlib import Path
import subprocess
import sys

import pytest

import comply_ros
from comply_ros.experiments import train
from comply_ros.plots import training_plots
from comply_ros.terminal import run_report

MAP = (Path(comply_ros.__file__).parent / 'maps' / 'bar_grid.yaml').read_text()
START = 'import sys; from comply_ros.executables import {0}; sys.argv[0] = "{0}"; sys.exit({0}())'
NAMES = {'markup': '[bold]a[/bold]', 'closing tag': '[/]', 'emoji': ':smile:',
         'mathematics': 'cost_$5_to_$10', 'broken mathematics': r'$\frac$',
         'template': '{0}%s%(a)',
         'foreign letters': '地图 ☃', 'shell': '$(date) `date` ~ * "\'', 'yaml': 'a: b #c',
         'html': '<b>&amp;', 'a line break': 'a\nb', 'no unicode': os.fsdecode(b'a\xff'),
         'an escape sequence': '\x1b[31mred'}


def command(name, *arguments, folder, **environment):
    """Run a command to its end in a folder; return it with all that it printed."""
    return subprocess.run([sys.executable, '-c', START.format(name), *arguments], check=False,
                          capture_output=True, cwd=folder, text=True, errors='replace',
                          env={**os.environ, **environment})


def small(map_name, out, *more):
    """Return arguments of a short training."""
    return ('--map', map_name, '--mentor', 'noisy:0.2', '--iterations', '2', '--episodes', '2',
            '--out', out, *more)


@pytest.mark.parametrize('name', NAMES.values(), ids=NAMES)
@pytest.mark.long
def test_train_takes_a_name_of_any_letters(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / f'{name.replace("/", "|")}.yaml'
    file.write_text(MAP)
    assert train.main(['train', *small(file.name, f'out/{file.stem}')]) == 0
    folder = tmp_path / 'out' / file.stem
    assert json.loads((folder / 'summary.json').read_text())['map'] == file.name
    assert (folder / 'trust_map.png').exists()
    shown, progress = capsys.readouterr()
    path = f'out/{file.stem}/summary.json'
    assert (path if file.stem.isprintable() else repr(path)) in shown
    assert 'Warning' not in progress and '\x1b' not in shown


@pytest.mark.parametrize('name', ['sweep [b]x[/b]', 'a:smile:'])
@pytest.mark.long
def test_sweep_prints_the_name_of_its_table_as_it_is(name, tmp_path):
    (tmp_path / 'a.yaml').write_text('map: bar_grid\nmethods: [sarsa]\nmentors: [none]\nseeds: 1\n'
                                     'settings: {iterations: 2, episodes: 2}\n')
    done = command('sweep', 'a.yaml', '--out', f'{name}.csv', folder=tmp_path)
    assert f'  {name}.csv: 1 runs' in done.stdout, done.stderr


def test_a_name_is_printed_where_the_locale_has_no_letters_for_it(tmp_path):
    (tmp_path / '地图.yaml').write_text(MAP)
    done = command('train', *small('地图.yaml', '地图'), folder=tmp_path,
                   PYTHONIOENCODING='ascii')
    assert done.returncode == 0, done.stderr
    assert r'\u5730\u56fe/summary.json' in done.stdout


def test_what_was_learned_is_on_disk_before_anything_is_drawn(tmp_path, monkeypatch, capsys):
    def fail(*arguments):
        assert {'summary.json', 'learning.npz', 'mentor.txt'} <= set(os.listdir(tmp_path))
        raise RuntimeError('no picture')
    monkeypatch.setattr(training_plots, 'draw_learning_curve', fail)
    result = comply_ros.train('bar_grid', iterations=2, episodes=2)
    with pytest.raises(RuntimeError, match='no picture'):
        result.save(tmp_path)
    with pytest.raises(RuntimeError, match='no picture'):
        run_report.report_training(result.training, tmp_path, result.reference, result.advice,
                                   [result.outcome()])
    printed = capsys.readouterr().out
    assert 'learned policy' in printed and 'summary.json' in printed
    assert 'learning_curve.png' not in printed
