# SPDX-License-Identifier: Apache-2.0
"""YAML of which every value knows its line, so that a mistake can name it."""

from typing import NamedTuple

import yaml

from comply_ros.storage.bounded_yaml import BoundedLoader, BoundError, shown

LONGEST = 1000  # characters of a value


class SweepFileError(ValueError):
    """A sweep file that cannot be; the message names the file, the line, the rule, the value."""


class Item(NamedTuple):
    """A value of the file and the line that it stands in."""

    value: object
    line: int


def wrong(line, text):
    """Raise a `SweepFileError` that names the line."""
    raise SweepFileError(f'line {line}: {text}') from None


def compose(text):
    """
    Root node of YAML text, None if it is empty.

    Raises
    ------
    SweepFileError: if it is not YAML.

    """
    try:
        return yaml.compose(text, BoundedLoader)
    except BoundError as error:
        wrong(error.problem_mark.line + 1, error.problem)
    except yaml.reader.ReaderError as error:
        wrong(text[:error.position].count('\n') + 1, 'a sweep must be valid YAML, got the '
              f'character {chr(error.character)!r}')
    except yaml.MarkedYAMLError as error:
        wrong(_mark(error).line + 1, f'a sweep must be valid YAML ({error.problem})')
    except RecursionError:
        wrong(1, 'a sweep must be valid YAML, got too many brackets')
    except (ArithmeticError, ValueError):  # a \\U or %YAML with a number that Python cannot take
        wrong(1, 'a sweep must be valid YAML, got a number beyond all bounds')


def _mark(error):
    """Where a YAML error began: an open bracket or quote, not the place where it is missed."""
    begins = error.context_mark and 'block' not in error.context
    return error.context_mark if begins else error.problem_mark


def table_of(node, rule):
    """`{key: (line, node)}` of a YAML table."""
    if not isinstance(node, yaml.MappingNode):
        wrong(node.start_mark.line + 1 if node else 1, f'{rule}, got {_kind(node)}')
    found = {}
    for key, value in node.value:
        line, name = key.start_mark.line + 1, item_of(key, 'a key').value
        if name in found:
            wrong(line, f'a key must be there once, got {shown(name)} again')
        found[name] = line, value
    return found


def _kind(node):
    if isinstance(node, yaml.ScalarNode):
        return shown(item_of(node, 'a value').value)
    return 'nothing' if node is None else 'a list' if node.id == 'sequence' else 'a table'


def item_of(node, what):
    """`Item` of a YAML node."""
    line = node.start_mark.line + 1
    if not isinstance(node, yaml.ScalarNode):
        wrong(line, f'{what} must be a single value, got {_kind(node)}')
    try:
        value = BoundedLoader('').construct_object(node, deep=True)
    except BoundError as error:
        wrong(line, error.problem)
    except yaml.YAMLError:
        wrong(line, f'{what} must be a text or a number, got {shown(node.value)}')
    if len(node.value) > LONGEST:
        wrong(line, f'{what} may have at most {LONGEST} characters, got {shown(node.value)}')
    return Item(value, line)


def items_of(key, node):
    """`Item` of each value; a scalar is the same as a list of one."""
    listed = isinstance(node, yaml.SequenceNode)
    items = [item_of(each, f'each of {key}' if listed else key)
             for each in (node.value if listed else [node])]
    return items or wrong(node.start_mark.line + 1, f'{key} must have a value, got an empty list')
