# SPDX-License-Identifier: Apache-2.0
"""Keys and maps of a terminal."""

import numpy as np
import pytest
from tiny_worlds import grid

from comply_ros.terminal.ansi_map import map_lines, window
from comply_ros.terminal.raw_terminal import keys_of

PLAIN = {'\x1b[0m': '', '\x1b[1m': '', '\x1b[2m': ''}


@pytest.mark.parametrize('sent, keys, left', [
    ('\x1b[A\x1bOBwq', ['up', 'down', 'w', 'q'], ''),
    ('\x1b[C\x1b[D', ['right', 'left'], ''),
    (' \t', [' ', '\t'], ''),
    ('a\x1b', ['a'], '\x1b'),
    ('\x1b[', [], '\x1b['),
    ('\x1b[1;5A', ['up'], ''),
    ('\x1b[3~x', ['x'], ''),
    ('\x1bq', ['q'], ''),
    ('', [], '')])
def test_a_terminal_sends_keys_and_beginnings_of_keys(sent, keys, left):
    assert keys_of(sent) == (keys, left)


def test_keys_are_the_same_wherever_what_was_sent_is_cut():
    sent = 'w\x1b[A\x1bOD \x1b[1;2Cq'
    for place in range(len(sent)):
        first, left = keys_of(sent[:place])
        assert first + keys_of(left + sent[place:])[0] == ['w', 'up', 'left', ' ', 'right', 'q']


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


def test_advice_is_green_where_it_is_trusted_and_red_where_not_and_the_cursor_is_reversed():
    policy = np.array([1, 1, -1])
    line, = map_lines(grid('..G'), policy, [1.0, 0.0, 0.0], None, 1, 80, 20)
    assert line == '\x1b[38;5;40m>\x1b[0m \x1b[38;5;196m\x1b[7m>\x1b[0m G'


def test_a_large_map_is_cut_round_the_robot():
    rows = ['.' * 40] * 29 + ['.' * 39 + 'G']
    policy = np.full(1200, -1)
    for robot in (0, 39, 1160, 1199, 620):
        lines = shown(map_lines(grid(*rows), policy, None, robot, None, 21, 7))
        assert len(lines) == 7 and {len(line) for line in lines} == {19}
        assert sum('@' in line for line in lines) == 1
    assert [window(focus, 3, 10) for focus in (0, 1, 5, 9)] == [0, 0, 4, 7]
    assert len(map_lines(grid(*rows), policy, None, None, None, 0, 0)) == 1
