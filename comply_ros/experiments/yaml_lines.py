# SPDX-License-Identifier: Apache-2.0
"""YAML in which every value knows its line, so that an error can name it."""

from typing import Any, NamedTuple, NoReturn

import yaml
from yaml.reader import ReaderError

from comply_ros.storage.user_files import BoundedLoader, BoundError, shown

MAX_VALUE_LENGTH = 1000  # characters


class SweepFileError(ValueError):
    """An invalid sweep file; the message names the file, the line, the rule and the value."""


class LinedValue(NamedTuple):
    """A value of the file and the line that it is in."""

    value: Any
    line: int


def fail(line: int, message: object) -> NoReturn:
    """Raise a `SweepFileError` that names the line."""
    raise SweepFileError(f'line {line}: {message}') from None


def line_of(node: yaml.Node | None) -> int:
    """Return the line in which a YAML node starts."""
    return node.start_mark.line + 1 if node and node.start_mark else 1


def compose(text: str) -> yaml.Node | None:
    """Return the root node of YAML text, None if it is empty; raise SweepFileError if invalid."""
    try:
        return yaml.compose(text, BoundedLoader)
    except ReaderError as error:
        fail(text[:error.position].count('\n') + 1, 'a sweep must be valid YAML, got the '
             f'character {chr(error.character)!r}')
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        if error.context_mark and 'block' not in str(error.context):
            mark = error.context_mark  # the open bracket or quote, not where its end is missed
        line = mark.line + 1 if mark else 1
        if isinstance(error, BoundError):
            fail(line, error.problem)
        fail(line, f'a sweep must be valid YAML ({error.problem})')
    except RecursionError:
        fail(1, 'a sweep must be valid YAML, got too many brackets')
    except (ArithmeticError, ValueError):  # a \\U or %YAML with a number that Python cannot take
        fail(1, 'a sweep must be valid YAML, got a number beyond all bounds')


def read_table(node: yaml.Node | None, rule: str) -> dict[Any, tuple[int, yaml.Node]]:
    """Return `{key: (line, node)}` of a YAML table; rule: for the error if it is none."""
    if not isinstance(node, yaml.MappingNode):
        fail(line_of(node), f'{rule}, got {_shown_node(node)}')
    table = {}
    for key_node, value in node.value:
        key, line = read_value(key_node, 'a key')
        if key in table:
            fail(line, f'a key must be there once, got {shown(key)} again')
        table[key] = line, value
    return table


def _shown_node(node: yaml.Node | None) -> str:
    if isinstance(node, yaml.ScalarNode):
        return shown(read_value(node, 'a value').value)
    return 'nothing' if node is None else (
        'a list' if isinstance(node, yaml.SequenceNode) else 'a table')


def read_value(node: yaml.Node, name: str) -> LinedValue:
    """Return the value of a YAML node, which must not be a list or a table."""
    line = line_of(node)
    if not isinstance(node, yaml.ScalarNode):
        fail(line, f'{name} must be a single value, got {_shown_node(node)}')
    try:
        value = BoundedLoader('').construct_object(node, deep=True)
    except BoundError as error:
        fail(line, error.problem)
    except yaml.YAMLError:
        fail(line, f'{name} must be a text or a number, got {shown(node.value)}')
    if len(node.value) > MAX_VALUE_LENGTH:
        fail(line, f'{name} may have at most {MAX_VALUE_LENGTH} characters, '
             f'got {shown(node.value)}')
    return LinedValue(value, line)


def read_values(key: str, node: yaml.Node) -> list[LinedValue]:
    """Return the values of a YAML list; a single value is the same as a list of one."""
    if not isinstance(node, yaml.SequenceNode):
        return [read_value(node, key)]
    values = [read_value(each, f'each of {key}') for each in node.value]
    return values or fail(line_of(node), f'{key} must have a value, got an empty list')
