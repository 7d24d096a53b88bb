# SPDX-License-Identifier: Apache-2.0
"""A progress bar fits the terminal, whatever its width."""

import io

import pytest
from rich.console import Console

from comply_ros.terminal import console as console_module
from comply_ros.terminal.console import iteration_status, progress_bar

STATUS = iteration_status(-13.82, 0.75, 12345.6)


def shown(monkeypatch, width, now, description='beta_implicit'):
    """Return the line of a progress bar at 200 of 400, in a terminal of this width."""
    wide = Console(file=io.StringIO(), width=width, force_terminal=True, color_system=None)
    monkeypatch.setattr(console_module, 'console', wide)
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
    (60, ['beta_implicit 200/400', '--:--', 'return  -13.82', 'confidence 0.75']),
    (50, ['beta_implicit 200/400', '--:--', 'return  -13.82']),
    (40, ['beta_implicit 200/400', 'return  -13.82'])])
def test_the_least_important_columns_are_left_out_first(monkeypatch, width, parts):
    line = shown(monkeypatch, width, STATUS)
    assert all(part in line for part in parts)
    assert '…' not in line


def test_a_long_text_is_cut_and_the_count_is_not(monkeypatch):
    line = shown(monkeypatch, 60, 'grid_world was killed and starts again, for the second time')
    assert line.startswith('beta_implicit 200/400 grid_world was') and line.endswith('…')


def test_a_learner_without_advice_has_no_confidence_to_show():
    assert iteration_status(1.0, float('nan')) == ('return    1.00',)
