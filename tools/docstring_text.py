# SPDX-License-Identifier: Apache-2.0
"""The docstrings of this package in the form of numpydoc, which Griffe reads."""

import re

SECTIONS = {'Parameters', 'Attributes', 'Returns', 'Raises', 'Yields'}
ENTRY = re.compile(r'(\*{0,2}\w[\w., *]*?): (.*)')


def separate_entries(text: str) -> str:
    """
    Return a docstring with `name: text` in its sections as two lines, `name` and indented `text`.

    numpydoc would take the text behind the colon for a type; here types are annotations.
    """
    lines: list[str] = []
    section = before = ''
    for line in text.splitlines():
        if set(line) == {'-'}:
            section = before if before in SECTIONS else ''
        entry = ENTRY.fullmatch(line)
        lines += [entry[1], f'    {entry[2]}'] if section and entry else [line]
        before = line
    return '\n'.join(lines)
