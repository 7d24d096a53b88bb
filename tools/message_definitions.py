# SPDX-License-Identifier: Apache-2.0
"""What the text of a message or service definition says, comments included."""

from pathlib import Path
import re
from typing import NamedTuple

from ament_index_python import get_package_share_directory


class Field(NamedTuple):
    """One line of a definition; `value` is None but for a constant."""

    kind: str
    name: str
    value: str
    text: str


class Definition(NamedTuple):
    """A message, or one half of a service: the sentence on top, and its lines."""

    text: str
    fields: tuple


def definitions(kind):
    """
    Return the `Definition`s of an installed type: one of a message, two of a service.

    kind: such as `std_srvs/srv/Trigger`.
    """
    package, room, name = kind.split('/')
    path = Path(get_package_share_directory(package)) / room / f'{name}.{room}'
    return [read_definition(half) for half in re.split('(?m)^---$', path.read_text())]


def read_definition(source):
    """`Definition` of the lines of a message."""
    lines = [line.strip() for line in source.strip().splitlines()]
    begin = next((i for i, line in enumerate(lines) if not line.startswith('#')), len(lines))
    on_top = begin == len(lines) or not lines[begin]  # else it belongs to the first field
    text = ' '.join(line.lstrip('# ') for line in lines[:begin]) if on_top else ''
    return Definition(text, tuple(_fields(lines[begin:] if on_top else lines)))


def _fields(lines):
    """Yield every field and constant, with the comment behind it, or the ones before it."""
    before = []
    for line in lines:
        code, _, comment = (part.strip() for part in line.partition('#'))
        if not code:
            before = [*before, comment] if comment else []
            continue
        kind, rest = code.split(maxsplit=1)
        name, is_constant, value = (part.strip() for part in rest.partition('='))
        yield Field(kind, name, value if is_constant else None, comment or ' '.join(before))
        before = []
