# SPDX-License-Identifier: Apache-2.0
"""A tidy table as a CSV file that grows row by row and at every moment has only whole rows."""

from codecs import BOM_UTF8
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
import csv
import fcntl
import io
from pathlib import Path

from comply_ros.storage.run_files import OutputError, prepare_folder

MAX_HEADER_BYTES = 65_536


class TableError(ValueError):
    """A file that is not the expected table; the message names it, the rule and the value."""


class CsvTable:
    """
    The rows of a CSV file, which is made if it does not exist; to be used in a `with`.

    An incomplete last line, which a killed process may leave, is cut off. Raises OutputError if
    the file cannot be written, TableError if it is another table or another process writes it.
    """

    def __init__(self, path: str | Path, columns: Iterable[str]) -> None:
        self.path, self.columns = Path(path).expanduser(), tuple(columns)
        if self.path.suffix != '.csv':
            raise OutputError(f'a table must be a file that ends in .csv, got {str(self.path)!r}')
        prepare_folder(self.path.parent)
        try:
            self._file = self.path.open('ab+', buffering=0)
        except OSError as error:
            raise OutputError(f'a table must be writable, got {str(self.path)!r} '
                              f'({str(error.strerror).lower()})') from None
        try:
            self._lock()
            self._end = self._end_of_last_line()
            self._check_header()
            if self._end < self._size():
                self._file.truncate(self._end)
            if self._end == 0:
                self._write(self.columns)
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> 'CsvTable':
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def rows(self) -> Iterator[tuple[int, dict[str, str]]]:
        """Yield line number and `{column: text}` of each row; raise TableError if it is none."""
        with self.path.open(newline='', encoding='utf-8-sig', errors='replace') as file:
            for number, row in enumerate(csv.reader(file), 1):
                if len(row) != len(self.columns):
                    raise TableError(f'{self.path}, line {number}: a row must have '
                                     f'{len(self.columns)} values, got {len(row)}')
                if number > 1:
                    yield number, dict(zip(self.columns, row))

    def append(self, values: Mapping[str, object]) -> None:
        """Add a row to the file, whole or (OSError) not at all; None becomes an empty cell."""
        self._write([values[name] for name in self.columns])

    def _write(self, row: Iterable[object]) -> None:
        rest = _line(row)
        size = len(rest)
        try:
            while rest:
                rest = rest[self._file.write(rest):]
        except OSError as error:
            with suppress(OSError):
                self._file.truncate(self._end)
            raise OSError(error.errno, error.strerror, str(self.path)) from None
        self._end += size

    def _lock(self) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise TableError(f'{self.path}: a table must have one writer, and another process '
                             'is writing it') from None

    def _size(self) -> int:
        return self._file.seek(0, io.SEEK_END)

    def _end_of_last_line(self) -> int:
        """Return the position after the last line end, searched from the end of the file."""
        start = self._size()
        while start:
            end, start = start, max(0, start - io.DEFAULT_BUFFER_SIZE)
            self._file.seek(start)
            found = self._file.read(end - start).rfind(b'\n')
            if found >= 0:
                return start + found + 1
        return 0

    def _check_header(self) -> None:
        size = min(self._size(), MAX_HEADER_BYTES)
        self._file.seek(0)
        expected, header = _line(self.columns), self._file.read(size).removeprefix(BOM_UTF8)
        header = header.replace(b'\r\n', b'\n')  # another program may have saved the table
        if expected.startswith(header) or header.startswith(expected):
            return
        names = next(csv.reader([header.split(b'\n', 1)[0].decode(errors='replace')]), ())
        text = ', '.join(names)
        raise TableError(f'{self.path}: its first line must be {", ".join(self.columns)}, '
                         f'got {text if len(text) <= 400 else f"{text[:400]}..."}')


def _line(row: Iterable[object]) -> bytes:
    line = io.StringIO()
    csv.writer(line, lineterminator='\n').writerow(row)
    return line.getvalue().encode()
