# SPDX-License-Identifier: Apache-2.0
"""A progress bar fits the terminal, whatever its width."""

import io
from pathlib import Path

import pytest
from rich.console import Console

from comply_ros.terminal import console as console_module
from comply_ros.terminal.console import iteration_status, progress_bar, show_paths

STATUS = iteration_status(-13.82, 0.75, 12345.6)


def shown(monkeypatch, width, now, description='beta_implicit'):
    """Return the line of a progress bar at 200 of 400, in a terminal of this width."""
    wide = Console(file=io.StringIO(), width=width, force_terminal=True, color_system=None)
    monkeypatch.setattr(console_module, 'progress_console', wide)
    bar = progress_bar()
    bar.add_task(description, total=400, completed=200, now=now)
    with wide.capture() as capture:
        wide.print(bar.get_renderable())
    line, = capture.get().splitlines()
    assert len(line) <= width
    return line.strip()


def test_a_wide_terminal_shows_everything(monkeypatch):
    line = shown(monkeypatch, 120, STATUS)
    assert line.endswith('200/400 --:-- return  -13.82  confidence 0.75  12,346 steps/s')
    assert '━' in line and line[0] not in 'b━'


@pytest.mark.parametrize('width, parts', [
    (80, ['beta_implicit ━', '200/400', '--:--', 'return  -13.82', 'confidence 0.75']),
    (70, ['beta_implicit ━', '200/400', '--:--', 'return  -13.82', 'confidence 0.75']),
    (60, ['beta_implicit ━', '200/400', 'return  -13.82', 'confidence 0.75']),
    (50, ['beta_implicit ━', '200/400', 'return  -13.82']),
    (40, ['beta_implicit 200/400', 'return  -13.82'])])
def test_the_least_important_columns_are_left_out_first(monkeypatch, width, parts):
    line = shown(monkeypatch, width, STATUS)
    assert all(part in line for part in parts)
    assert '…' not in line


def test_a_long_text_is_cut_and_the_count_is_not(monkeypatch):
    line = shown(monkeypatch, 60, 'grid_world was killed and starts again, for the second time')
    assert line.startswith('beta_implicit') and '200/400 grid_world was' in line
    assert line.endswith('…')


def test_a_learner_without_advice_has_no_confidence_to_show():
    assert iteration_status(1.0, float('nan')) == ('return    1.00',)


def test_results_go_to_standard_output_and_progress_to_standard_error(capsys):
    console_module.console.print('a result')
    console_module.progress_console.print('a note')
    assert tuple(capsys.readouterr()) == ('a result\n', 'a note\n')


def test_lines_of_a_file_are_not_broken(capsys, monkeypatch):
    monkeypatch.delenv('COLUMNS', raising=False)
    console_module.show_columns(('name', 'value'), [('a' * 150, '1')])
    assert 'a' * 150 in capsys.readouterr().out.splitlines()[1]


def test_names_are_no_markup_in_a_progress_bar(monkeypatch):
    line = shown(monkeypatch, 120, ('[b]x[/b] :smile:',), description='[i]name[/i]')
    assert line.startswith('[i]name[/i]') or ' [i]name[/i]' in line
    assert line.endswith('[b]x[/b] :smile:')


@pytest.mark.parametrize('columns', [60, 80])
def test_a_table_is_not_wider_than_the_terminal_and_nothing_is_cut(monkeypatch, capsys, columns):
    monkeypatch.setenv('COLUMNS', str(columns))
    monkeypatch.setattr(console_module, 'console', console_module.PlainConsole())
    names = ['beta_implicit_off_policy', 'a' * 70]
    console_module.show_columns(('node', 'MB after 1,000,000 steps', 'MB at the end', 'growth'),
                                [(name, '123.45', '123.45', '+0.00') for name in names])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= columns
    assert ''.join(lines).count('a') >= 70 and '…' not in ''.join(lines)


@pytest.mark.parametrize('width, lines', [
    (60, ['  runs/a_long_name_of_a_run/learning_curve.png']),
    (40, ['  runs/a_long_name_of_a_run/', '    learning_curve.png'])])
def test_the_name_of_a_file_is_not_broken_by_a_narrow_terminal(monkeypatch, width, lines):
    narrow = Console(file=io.StringIO(), width=width, force_terminal=True, color_system=None)
    monkeypatch.setattr(console_module, 'console', narrow)
    show_paths([Path('runs/a_long_name_of_a_run/learning_curve.png')])
    assert narrow.file.getvalue().splitlines() == lines


def test_a_path_that_is_not_for_a_terminal_is_one_line(capsys):
    path = Path('/'.join(['a_long_name_of_a_folder'] * 20))
    show_paths([path])
    assert capsys.readouterr().out == f'  {path}\n'
