# SPDX-License-Identifier: Apache-2.0
"""A parser of command lines that reads numbers as maps and sweeps do."""

import argparse
import os
from pathlib import Path
from typing import Any, NoReturn

from comply_ros.numerics.number_text import NUMBER, read_integer, read_number


class CommandParser(argparse.ArgumentParser):
    """
    An `ArgumentParser` whose errors are one line.

    Every negative number is a value for it, also -1e3.
    """

    def __init__(self, *args: Any, **settings: Any) -> None:
        super().__init__(*args, **settings)
        self._negative_number_matcher = NUMBER  # its own one knows no exponents

    def error(self, message: str) -> NoReturn:
        """End with 2 and one sentence, which says of a wrong value what it must be."""
        hint = '' if message.startswith('argument ') else '; --help shows what there is'
        self.exit(2, f'{self.prog}: {message}{hint}\n')


def whole_number(text: str) -> int:
    """Value of an option in whole numbers, for `type=`; raises the error that argparse prints."""
    try:
        return read_integer(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def file_to_write(text: str) -> Path:
    """Value of an option that is the path of a file, for `type=`, as `whole_number`."""
    path = Path(text)
    if path.is_dir() or not os.access(path.parent, os.W_OK):
        raise argparse.ArgumentTypeError(f'it must be a file that can be written, got {text!r}')
    return path


def real_number(text: str) -> float:
    """Value of an option that is a number, for `type=`; raises the error that argparse prints."""
    try:
        return float(read_number(text))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
