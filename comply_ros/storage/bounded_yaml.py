# SPDX-License-Identifier: Apache-2.0
"""Reads text and YAML files of users within limits of size, nesting and number of values."""

from pathlib import Path
import re
from typing import Any

import yaml
from yaml.constructor import ConstructorError

from comply_ros.storage.file_system import path_errors, PathError

MAX_CHARACTERS = 32_000_000  # of a file: more than the largest map has
MAX_NUMBER_LENGTH = 50  # characters of a number in YAML
MAX_VALUES = 50_000  # in YAML; an alias counts as what it stands for, a long text by thousands
# What PyYAML counts as one column each.
ONE_LINE = re.compile('[^\\n\\r\\x85\\u2028\\u2029\\ufeff]*')


class BoundError(yaml.MarkedYAMLError):
    """YAML beyond a bound, at a line; `problem` names the rule and the value."""

    def __init__(self, problem: str, node: yaml.Node) -> None:
        super().__init__(problem=problem, problem_mark=node.start_mark)
        self.line = node.start_mark.line + 1


def read_text(path: str | Path) -> str:
    """
    Text of a file.

    Raises
    ------
    PathError: whatever the path and the file are; the message is the reason.

    """
    with path_errors(), Path(path).expanduser().open(encoding='utf-8') as file:
        text = file.read(MAX_CHARACTERS + 1)
    if len(text) > MAX_CHARACTERS:
        raise PathError(f'it has more than {MAX_CHARACTERS} characters')
    return text


def shown(value: object, longest: int = 60) -> str:
    """Text of a value for a message: on one line, cut where it is long."""
    text = repr(value)
    return text if len(text) <= longest else text[:longest - 3] + '...'


class BoundedLoader(yaml.SafeLoader):
    """
    Safe YAML with bounds for its values, aliases included, and for its numbers.

    Raises
    ------
    yaml.YAMLError: for all that is wrong in it, of which BoundError has a sentence of its own;
        but RecursionError where it is nested too deeply.

    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._count, self._weights = 0, {}

    def forward(self, length: int = 1) -> None:
        """Advance by so many characters; within a line at once, where PyYAML counts each."""
        end = self.pointer + length
        if length > 1 and ONE_LINE.fullmatch(self.buffer, self.pointer, end) \
                and end < len(self.buffer):
            self.pointer, self.index, self.column = end, self.index + length, self.column + length
        else:
            super().forward(length)

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Return the next node, counted with all below it; an alias as what it stands for."""
        is_alias, before = self.check_event(yaml.AliasEvent), self._count
        node = super().compose_node(parent, index)
        if is_alias:
            self._count += self._weights.get(node, 1)
        else:
            is_text = isinstance(node, yaml.ScalarNode)
            self._count += 1 + len(node.value) // 1000 if is_text else 1
            self._weights[node] = self._count - before
        if self._count > MAX_VALUES:
            raise BoundError(f'YAML may have at most {MAX_VALUES} values, got more', node)
        return node

    def compose_mapping_node(self, anchor: Any) -> Any:
        """Return the node of a table in which every key is there once."""
        node, seen = super().compose_mapping_node(anchor), set()
        for key, _ in node.value:
            written = isinstance(key, yaml.ScalarNode) and (key.tag, key.value)
            if written and written in seen:
                raise BoundError(f'a key must be there once, got {shown(key.value)} again', key)
            seen.add(written)
        return node

    def construct_object(self, node: Any, deep: bool = False) -> Any:
        """Return the value of a node, also of those such as `!!int ''` that PyYAML fails at."""
        is_number = isinstance(node, yaml.ScalarNode) and node.tag.endswith((':int', ':float'))
        if is_number and len(node.value) > MAX_NUMBER_LENGTH:
            raise BoundError(f'a number may have at most {MAX_NUMBER_LENGTH} characters, '
                             f'got {shown(node.value)}', node)
        try:
            return super().construct_object(node, deep)
        except (ArithmeticError, AttributeError, LookupError, ValueError):
            raise ConstructorError(
                None, None, 'found a value that is not of its tag', node.start_mark) from None
