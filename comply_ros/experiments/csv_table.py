# SPDX-License-Identifier: Apache-2.0
"""A tidy table as a CSV file that grows row by row and has only whole rows at every moment."""

from contextlib import suppress
import csv
import fcntl
import io
from pathlib import Path

from comply_ros.storage.run_files import OutputError, prepare_folder

LONGEST_HEADER = 65_536


class TableError(ValueError):
    """A file that is not the table it is taken for; the message names it, the rule, the value."""


class Table:
    """
    The rows that are in a file, and those to come; to be used in a `with`.

    A last line without its end, which a killed process may leave, is cut off.

    Parameters
    ----------
    path: of the file, made if it is not there.
    columns: their names.

    Raises
    ------
    OutputError: if it cannot be written.
    TableError: if it is another table, or another process is writing it.
    OSError: if there is no room for its first line.

    """

    def __init__(self, path, columns):
        self.path, self.columns = Path(path).expanduser(), tuple(columns)
        self._file = _open(self.path)
        try:
            self._claim()
            self._end = self._end_of_last_line()
            self._check_header()
            if self._end < self._size():
                self._file.truncate(self._end)
            if self._end == 0:
                self._write(self.columns)
        except BaseException:
            self._file.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._file.close()

    def rows(self):
        """
        Yield the number of the line and `{column: text}` of each row that is in the file.

        Raises
        ------
        TableError: for a line that is no row of it.

        """
        with self.path.open(newline='', errors='replace') as file:
            for number, row in enumerate(csv.reader(file), 1):
                if len(row) != len(self.columns):
                    raise TableError(f'{self.path}, line {number}: a row must have '
                                     f'{len(self.columns)} values, got {len(row)}')
                if number > 1:
                    yield number, dict(zip(self.columns, row))

    def append(self, values):
        """
        Change the file: one row more, `{column: value}`; None becomes an empty cell.

        Raises
        ------
        OSError: if it cannot be written whole; then nothing of it is.

        """
        self._write([values[name] for name in self.columns])

    def _write(self, cells):
        left = _line(cells)
        size = len(left)
        try:
            while left:
                left = left[self._file.write(left):]
        except OSError as error:
            with suppress(OSError):
                self._file.truncate(self._end)
            raise OSError(error.errno, error.strerror, str(self.path)) from None
        self._end += size

    def _claim(self):
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise TableError(f'{self.path}: a table must have one writer, and another process '
                             'is writing it') from None

    def _size(self):
        return self._file.seek(0, io.SEEK_END)

    def _end_of_last_line(self):
        """Bytes up to and with the last line end; read from behind."""
        size = self._size()
        while size:
            begin = max(0, size - io.DEFAULT_BUFFER_SIZE)
            self._file.seek(begin)
            found = self._file.read(size - begin).rfind(b'\n')
            if found >= 0:
                return begin + found + 1
            size = begin
        return 0

    def _check_header(self):
        size = min(self._size(), LONGEST_HEADER)
        self._file.seek(0)
        wanted, there = _line(self.columns), self._file.read(size)
        if wanted.startswith(there) or there.startswith(wanted):
            return
        found = next(csv.reader([there.split(b'\n', 1)[0].decode(errors='replace')]), ())
        raise TableError(f'{self.path}: its first line must be {", ".join(self.columns)}, '
                         f'got {_short(", ".join(found))}')


def _line(cells):
    line = io.StringIO()
    csv.writer(line, lineterminator='\n').writerow(cells)
    return line.getvalue().encode()


def _open(path):
    if path.suffix != '.csv':
        raise OutputError(f'a table must be a file that ends in .csv, got {str(path)!r}')
    prepare_folder(path.parent)
    try:
        return path.open('ab+', buffering=0)
    except OSError as error:
        raise OutputError(f'a table must be writable, got {str(path)!r} '
                          f'({error.strerror.lower()})') from None


def _short(text):
    return text if len(text) <= 400 else f'{text[:400]}...'
