# SPDX-License-Identifier: Apache-2.0
"""One scale of colors for the confidence, wherever it is shown."""

import subprocess
import sys

import pytest

from comply_ros.plots.trust_colors import (
    palette,
    TRUST_ANCHORS,
    trust_color,
    XTERM_LEVELS,
    xterm_trust_color,
)


def test_a_palette_goes_through_its_anchors():
    colors = palette(('#ff0000', '#808080', '#0000ff'))
    assert colors.shape == (101, 3)
    assert colors[[0, 100]].tolist() == [[1, 0, 0], [0, 0, 1]]
    assert colors[50].tolist() == pytest.approx([128 / 255] * 3)


def test_no_half_and_full_confidence_have_the_colors_of_the_scale():
    assert [trust_color(p) for p in (0.0, 0.5, 1.0)] == [each.lower() for each in TRUST_ANCHORS]
    assert trust_color(0.75) == '#78ab5a'  # the mean of (240, 184, 64) and (0, 158, 115)
    assert [trust_color(p) for p in (-0.1, 1.1)] == [trust_color(p) for p in (0.0, 1.0)]


def test_a_terminal_shows_red_amber_and_green():
    codes = [xterm_trust_color(p) - 16 for p in (0.0, 0.5, 1.0)]
    assert [tuple(XTERM_LEVELS[n] for n in (code // 36, code // 6 % 6, code % 6))
            for code in codes] == [(215, 0, 0), (255, 175, 0), (0, 175, 95)]


def test_what_the_page_and_the_viewer_use_does_not_load_matplotlib():
    code = ('import sys, importlib\n'
            'for name in ("trust_colors", "running_mean", "state_layout", "viewer_geometry"):\n'
            '    importlib.import_module(f"comply_ros.plots.{name}")\n'
            '    assert "matplotlib" not in sys.modules, name')
    subprocess.run([sys.executable, '-c', code], check=True)
