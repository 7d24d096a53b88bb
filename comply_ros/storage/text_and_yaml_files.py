# SPDX-License-Identifier: Apache-2.0
"""Text and YAML files of users, read within limits of size, nesting and number of values."""

from io import StringIO
from pathlib import Path
import re
from typing import Any, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.composer import Composer, MaxDepthExceededError
from ruamel.yaml.constructor import ConstructorError, RoundTripConstructor
from ruamel.yaml.error import MarkedYAMLError
from ruamel.yaml.reader import Reader, ReaderError
from ruamel.yaml.scalarbool import ScalarBoolean

from comply_ros.numerics.number_text import NumberError, read_number
from comply_ros.storage.file_system import path_errors, PathError

MAX_CHARACTERS = 32_000_000  # of a file: more than the largest map has
MAX_DEPTH = 50  # of lists and tables in YAML
MAX_NUMBER_LENGTH = 50  # characters of a number in YAML
MAX_VALUES = 50_000  # in YAML; an alias counts as what it stands for, a long text by thousands
IN_LINE = re.compile('[^\\n\\r\\x85\\u2028\\u2029\\ufeff]*')  # what counts as one column each

Place = tuple[Any, ...]


class YamlError(ValueError):
    """
    Text that is not YAML, or breaks a rule of ours.

    Attributes
    ----------
    line: where, from 1.
    is_rule: whether the message is a rule with the value; else it is what the parser expected.

    """

    def __init__(self, line: int, message: object, is_rule: bool) -> None:
        super().__init__(str(message))
        self.line, self.is_rule = line, is_rule

    def about(self, name: str) -> str:
        """Sentence about the file that the text is of."""
        if self.is_rule:
            return str(self)
        return f'{name} must be valid YAML' + (
            f', {self}' if str(self).startswith('got ') else f' ({self})')


class LinedYaml(NamedTuple):
    """
    What a YAML text contains, and where.

    value: of plain dicts, lists, str, int, float, bool, None, and dates.
    lines: of keys and items, by their path: `('seeds', 0)` is the first of the seeds.
    """

    value: Any
    lines: dict[Place, int]

    def line_of(self, path: Place) -> int:
        """Line of a value; of one that has no line of its own, that of what it is in."""
        return next((self.lines[path[:end]] for end in range(len(path), -1, -1)
                     if path[:end] in self.lines), 1)


def read_text(path: str | Path) -> str:
    """
    Text of a file in UTF-8, without its byte order mark, each line ended by one character.

    Raises
    ------
    PathError: whatever the path and the file are; the message is the reason.

    """
    with path_errors(), Path(path).expanduser().open(encoding='utf-8-sig') as file:
        text = file.read(MAX_CHARACTERS + 1)
    if len(text) > MAX_CHARACTERS:
        raise PathError(f'it has more than {MAX_CHARACTERS} characters')
    return text


def shown(value: object, longest: int = 60) -> str:
    """Text of a value for a message: on one line, cut where it is long."""
    text = repr(value)
    return text if len(text) <= longest else text[:longest - 3] + '...'


def load_yaml(text: str) -> LinedYaml:
    """
    Content of a YAML 1.2 text, in which every key is there once and numbers are decimal.

    Blanks at the end of a line do not count.

    Raises
    ------
    YamlError: for any other text, and for one beyond the limits.

    """
    text = '\n'.join(line.rstrip(' \t') for line in text.split('\n'))
    yaml = YAML(typ='rt', pure=True)
    yaml.Reader, yaml.Composer, yaml.Constructor = _Reader, _Composer, _Constructor
    yaml.max_depth = MAX_DEPTH
    lines: dict[Place, int] = {}
    try:
        return LinedYaml(_plain(yaml.load(text), (), lines), lines)
    except ReaderError as error:
        raise YamlError(text[:error.position].count('\n') + 1,
                        f'got the character {chr(error.character)!r}', False) from None
    except MaxDepthExceededError:
        raise YamlError(1, 'got too many brackets', False) from None
    except MarkedYAMLError as error:
        mark = error.problem_mark
        if error.context_mark and 'block' not in str(error.context):
            mark = error.context_mark  # the open bracket or quote, not where its end is missed
        is_rule = isinstance(error, _RuleError)
        raise YamlError(mark.line + 1 if mark else 1, error.problem, is_rule) from None
    except RecursionError:
        raise YamlError(1, 'got a value inside itself', False) from None
    except (ArithmeticError, ValueError):  # a \\U or %YAML with a number that Python cannot take
        raise YamlError(1, 'got a number beyond all bounds', False) from None


def dump_yaml(value: Any) -> str:
    """Return the YAML text of plain tables, lists and values, as `load_yaml` reads it."""
    text = StringIO()
    YAML(typ='safe', pure=True).dump(value, text)
    return text.getvalue()


class _RuleError(MarkedYAMLError):
    """A broken rule of ours, at a node; `problem` is the rule and the value."""

    def __init__(self, problem: str, node: Any) -> None:
        super().__init__(problem=problem, problem_mark=node.start_mark)


class _Reader(Reader):

    def forward(self, length: int = 1) -> None:
        """Advance by so many characters; within a line at once: rows of maps are long."""
        end = self.pointer + length
        if length > 1 and end + 1 < len(self.buffer) \
                and IN_LINE.fullmatch(self.buffer, self.pointer, end):
            self.pointer, self.index, self.column = end, self.index + length, self.column + length
        else:
            super().forward(length)


class _Composer(Composer):
    """Counts the nodes of a text; an alias as what it stands for."""

    def __init__(self, loader: Any = None) -> None:
        super().__init__(loader=loader)
        self.warn_double_anchors = False
        self._count, self._weights = 0, {}

    def return_alias(self, node: Any) -> Any:
        self._add(node, self._weights.get(id(node), 1))
        return node

    def compose_node(self, parent: Any, index: Any) -> Any:
        before = self._count
        node = super().compose_node(parent, index)
        if id(node) not in self._weights:
            size = len(node.value) // 1000 if isinstance(node.value, str) else 0
            self._add(node, 1 + size)
            self._weights[id(node)] = self._count - before
        return node

    def _add(self, node: Any, weight: int) -> None:
        self._count += weight
        if self._count > MAX_VALUES:
            raise _RuleError(f'YAML may have at most {MAX_VALUES} values, got more', node)


class _Constructor(RoundTripConstructor):
    """Reads numbers as we read them elsewhere, and names a key that is there twice."""

    def construct_non_recursive_object(self, node: Any, tag: str | None = None) -> Any:
        try:
            return super().construct_non_recursive_object(node, tag)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            raise ConstructorError(
                None, None, 'got a value that is not of its tag', node.start_mark) from None

    def construct_number(self, node: Any) -> int | float:
        text = node.value
        if len(text) > MAX_NUMBER_LENGTH:
            raise _RuleError(f'a number may have at most {MAX_NUMBER_LENGTH} characters, '
                             f'got {shown(text)}', node)
        try:
            return read_number(text)
        except NumberError as error:
            raise _RuleError(str(error), node) from None

    def check_mapping_key(self, node: Any, key_node: Any, mapping: Any, key: Any,
                          value: Any) -> bool:
        if key in mapping:
            raise _RuleError(f'a key must be there once, got {shown(key)} again', key_node)
        return True


for tag in 'int', 'float':
    _Constructor.add_constructor(f'tag:yaml.org,2002:{tag}', _Constructor.construct_number)


def _plain(value: Any, path: Place, lines: dict[Place, int]) -> Any:
    """Return a value in plain types; put the lines of all that is in it into `lines`."""
    if isinstance(value, CommentedMap | CommentedSeq):
        lines.setdefault(path, value.lc.line + 1)
    if isinstance(value, CommentedMap):
        table = {}
        for key, item in value.items():
            if key in value.lc.data:
                lines[*path, key] = value.lc.key(key)[0] + 1
            table[key] = _plain(item, (*path, key), lines)
        return table
    if isinstance(value, CommentedSeq):
        for k in range(len(value)):
            lines[*path, k] = value.lc.item(k)[0] + 1
        return [_plain(item, (*path, k), lines) for k, item in enumerate(value)]
    if isinstance(value, ScalarBoolean):
        return bool(value)
    return str(value) if isinstance(value, str) else value
