# SPDX-License-Identifier: Apache-2.0
"""The one reader of numbers that users write: on a command line, in a map, in a sweep."""

import re

RULE = 'a number must be written like 10, 0.5 or 1e-3'
MAX_LENGTH = 1000  # characters: Python converts 4300 digits at most
NUMBER = re.compile(r'[-+]?(?:(?:0|[1-9][0-9]*)(\.[0-9]*)?|(\.[0-9]+))([eE][-+]?[0-9]+)?')
NOT_FINITE = ('nan', 'inf', '-inf')


class NumberError(ValueError):
    """A text that is not a number of the wanted type; the message has the rule and the text."""


def read_number(text: str) -> int | float:
    """
    Value of a number in text: an int without point and exponent, else a float.

    There is one way to write a number, in decimal: without zeros in front, which other programs
    take for octal (010), without colons, which YAML 1.1 takes for base 60 (1:30), and without
    underscores. Blanks around it do not count. `nan`, `inf` and `-inf` are floats, so that the
    one who knows the range can name it.

    Raises
    ------
    NumberError: for any other text.

    """
    written = text.strip(' \t\r\n')
    if written in NOT_FINITE:
        return float(written)
    match = NUMBER.fullmatch(written)
    if match is None or len(text) > MAX_LENGTH:
        raise NumberError(f'{RULE}, got {text!r}')
    return float(match[0]) if any(match.groups()) else int(match[0])


def read_integer(text: str) -> int:
    """
    Value of a whole number in text, as `read_number` reads it.

    Raises
    ------
    NumberError: for any other text.

    """
    number = read_number(text)
    if not isinstance(number, int):
        raise NumberError(f'a whole number must be written like 10, got {text!r}')
    return number
