# SPDX-License-Identifier: Apache-2.0
"""Keys of a terminal."""

import pytest

from comply_ros.terminal.raw_terminal import keys_of


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
def test_input_is_split_into_keys_and_an_unfinished_sequence(sent, keys, left):
    assert keys_of(sent) == (keys, left)


def test_keys_are_the_same_wherever_the_input_is_cut():
    sent = 'w\x1b[A\x1bOD \x1b[1;2Cq'
    for place in range(len(sent)):
        first, left = keys_of(sent[:place])
        assert first + keys_of(left + sent[place:])[0] == ['w', 'up', 'left', ' ', 'right', 'q']
