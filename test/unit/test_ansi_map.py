# SPDX-License-Identifier: Apache-2.0
"""A map as lines of a terminal."""

import numpy as np
from tiny_worlds import grid

from comply_ros.terminal.ansi_map import first_shown, map_lines

PLAIN = {'\x1b[0m': '', '\x1b[1m': '', '\x1b[2m': ''}


def shown(lines):
    """Return lines without bold and dim."""
    for code, text in PLAIN.items():
        lines = [line.replace(code, text) for line in lines]
    return lines


def test_a_map_shows_robot_advice_and_cells_top_row_first():
    room = grid('..G', '.#.', '...')
    policy = np.array([3, 1, -1, -1, -1, 3, -1, -1, -1])
    assert shown(map_lines(room, policy, None, 2, None, 80, 20)) == [
        '. . G', '. # ^', '^ > @']


def test_advice_has_the_color_of_its_confidence_and_the_cursor_is_reversed():
    policy = np.array([1, 1, -1])
    line, = map_lines(grid('..G'), policy, [1.0, 0.0, 0.0], None, 1, 80, 20)
    assert line == '\x1b[38;5;35m>\x1b[0m \x1b[38;5;160m\x1b[7m>\x1b[0m G'


def test_a_large_map_is_cut_around_the_robot():
    rows = ['.' * 40] * 29 + ['.' * 39 + 'G']
    policy = np.full(1200, -1)
    for robot in (0, 39, 1160, 1199, 620):
        lines = shown(map_lines(grid(*rows), policy, None, robot, None, 21, 7))
        assert len(lines) == 7 and {len(line) for line in lines} == {19}
        assert sum('@' in line for line in lines) == 1
    assert [first_shown(focus, 3, 10) for focus in (0, 1, 5, 9)] == [0, 0, 4, 7]
    assert len(map_lines(grid(*rows), policy, None, None, None, 0, 0)) == 1
