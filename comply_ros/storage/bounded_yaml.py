# SPDX-License-Identifier: Apache-2.0
"""What users give as files, within bounds: text that ends, YAML that stays small in memory."""

from pathlib import Path
import re

import yaml

LONGEST = 32_000_000  # characters of a file: more than the largest map has
LONGEST_NUMBER = 50  # characters of a number in YAML
MOST_VALUES = 50_000  # in YAML; a value behind an alias counts each time, a text by thousands
ONE_LINE = re.compile('[^\\n\\r\\x85\\u2028\\u2029\\ufeff]*')  # what takes a column each


class UnreadableError(ValueError):
    """A file that cannot be read as text; the message is the reason."""


class BoundError(yaml.MarkedYAMLError):
    """YAML beyond a bound; `problem` names the rule and the value."""

    def __init__(self, problem, node):
        super().__init__(problem=problem, problem_mark=node.start_mark)


def read_text(path):
    """
    Text of a file.

    Raises
    ------
    UnreadableError: whatever the path and the file are; the message says why.

    """
    try:
        with Path(path).expanduser().open(encoding='utf-8') as file:
            text = file.read(LONGEST + 1)
    except UnicodeDecodeError:
        raise UnreadableError('it is not text') from None
    except OSError as error:
        raise UnreadableError(error.strerror.lower()) from None
    except ValueError:  # a NUL, or half of a character
        raise UnreadableError('no file can have this name') from None
    except RuntimeError:  # ~USER/
        raise UnreadableError('no such user') from None
    if len(text) > LONGEST:
        raise UnreadableError(f'it has more than {LONGEST} characters')
    return text


def shown(value):
    """Value as a message shows it: on one line, cut where it is long."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + '...'


class BoundedLoader(yaml.SafeLoader):
    """
    Safe YAML that is bounded: its values, aliases followed, and its numbers.

    Raises
    ------
    yaml.YAMLError: for all that is wrong in it, of which BoundError has a sentence of its own;
        but RecursionError where it is nested too deeply.

    """

    def __init__(self, text):
        super().__init__(text)
        self._count, self._weights = 0, {}

    def forward(self, length=1):
        """Go on by so many characters; within a line at once, where PyYAML counts each."""
        end = self.pointer + length
        if length > 1 and ONE_LINE.fullmatch(self.buffer, self.pointer, end) \
                and end < len(self.buffer):
            self.pointer, self.index, self.column = end, self.index + length, self.column + length
        else:
            super().forward(length)

    def compose_node(self, parent, index):
        """Return the next node, counted with all below it; an alias as what it stands for."""
        is_alias, begin = self.check_event(yaml.AliasEvent), self._count
        node = super().compose_node(parent, index)
        if is_alias:
            self._count += self._weights.get(node, 1)
        else:
            is_text = isinstance(node, yaml.ScalarNode)
            self._count += 1 + len(node.value) // 1000 if is_text else 1
            self._weights[node] = self._count - begin
        if self._count > MOST_VALUES:
            raise BoundError(f'YAML may have at most {MOST_VALUES} values, got more', node)
        return node

    def compose_mapping_node(self, anchor):
        """Return the node of a table in which every key is there once."""
        node, seen = super().compose_mapping_node(anchor), set()
        for key, _ in node.value:
            written = isinstance(key, yaml.ScalarNode) and (key.tag, key.value)
            if written and written in seen:
                raise BoundError(f'a key must be there once, got {shown(key.value)} again', key)
            seen.add(written)
        return node

    def construct_object(self, node, deep=False):
        """Return the value of a node; PyYAML itself falls over `!!int ''` and its like."""
        is_number = isinstance(node, yaml.ScalarNode) and node.tag.endswith((':int', ':float'))
        if is_number and len(node.value) > LONGEST_NUMBER:
            raise BoundError(f'a number may have at most {LONGEST_NUMBER} characters, '
                             f'got {shown(node.value)}', node)
        try:
            return super().construct_object(node, deep)
        except (ArithmeticError, AttributeError, LookupError, ValueError):
            raise yaml.constructor.ConstructorError(
                None, None, 'found a value that is not of its tag', node.start_mark) from None
