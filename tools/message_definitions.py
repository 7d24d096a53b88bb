# SPDX-License-Identifier: Apache-2.0
"""Message and service definitions with their comments, as they are installed."""

from collections.abc import Iterable, Iterator
from pathlib import Path
import re
from typing import NamedTuple

from ament_index_python import get_package_share_directory


class Field(NamedTuple):
    """A field or constant of a definition; `value` is None for a field."""

    kind: str
    name: str
    value: str | None
    text: str


class Definition(NamedTuple):
    """A message, or one half of a service: the comment at the top, and the fields."""

    text: str
    fields: tuple[Field, ...]


def definitions(kind: str) -> list[Definition]:
    """Return the definition of a message, or the two of a service such as std_srvs/srv/Trigger."""
    package, group, name = kind.split('/')
    path = Path(get_package_share_directory(package)) / group / f'{name}.{group}'
    return [parse_definition(half) for half in re.split('(?m)^---$', path.read_text())]


def parse_definition(source: str) -> Definition:
    """`Definition` of the text of a message."""
    lines = [line.strip() for line in source.strip().splitlines()]
    first = next((i for i, line in enumerate(lines) if not line.startswith('#')), len(lines))
    is_top = first == len(lines) or not lines[first]  # else the comment is of the first field
    text = ' '.join(line.lstrip('# ') for line in lines[:first]) if is_top else ''
    return Definition(text, tuple(_fields(lines[first:] if is_top else lines)))


def _fields(lines: Iterable[str]) -> Iterator[Field]:
    """Yield every field and constant, with the comment behind it, or the comments before it."""
    before: list[str] = []
    for line in lines:
        code, _, comment = (part.strip() for part in line.partition('#'))
        if not code:
            before = [*before, comment] if comment else []
            continue
        kind, rest = code.split(maxsplit=1)
        name, is_constant, value = (part.strip() for part in rest.partition('='))
        yield Field(kind, name, value if is_constant else None, comment or ' '.join(before))
        before = []
