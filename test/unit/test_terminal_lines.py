# SPDX-License-Identifier: Apache-2.0
"""Texts for terminals of any width."""

import pytest

from comply_ros.terminal.raw_terminal import wrapped, wrapped_items

ITEMS = ('arrows  move', 'space  erase', 'q  quit')


@pytest.mark.parametrize('columns, lines', [
    (80, ['arrows  move   space  erase   q  quit']),
    (30, ['arrows  move   space  erase', 'q  quit']),
    (14, ['arrows  move', 'space  erase', 'q  quit']),
    (8, ['arrows', 'move', 'space', 'erase', 'q  quit'])])
def test_items_stay_whole_where_the_width_allows_it(columns, lines):
    assert wrapped_items(ITEMS, columns) == lines


@pytest.mark.parametrize('columns', [0, 1, 20, 60, 80])
def test_no_line_is_longer_than_the_terminal_and_nothing_is_lost(columns):
    text = 'The robot waits for you in every step.'
    lines = wrapped(text, columns)
    assert max(map(len, lines)) <= max(1, columns)
    assert ''.join(lines).replace(' ', '') == text.replace(' ', '')


def test_an_empty_text_is_one_line():
    assert wrapped('', 60) == ['']
