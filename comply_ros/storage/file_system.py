# SPDX-License-Identifier: Apache-2.0
"""Files as the disk has them: written through, cut, and looked for where they may be gone."""

import os


def write_through(path, content):
    """Write a file, and have the disk take it; raises OSError."""
    with path.open('wb') as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def write_names_through(folder):
    """Have the disk take the names in a folder; raises OSError."""
    file = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def open_behind(path, end):
    """Cut a file off behind a place; return a descriptor to append there. Raises OSError."""
    file = os.open(path, os.O_WRONLY | os.O_CREAT, 0o666)
    try:
        os.ftruncate(file, end)
        os.lseek(file, end, os.SEEK_SET)
    except OSError:
        os.close(file)
        raise
    return file


def is_at(path, file):
    """Tell whether a path leads to an open file; where nobody may look, it counts as there."""
    try:
        return os.path.samestat(os.stat(path), os.fstat(file))
    except OSError as error:
        return not _is_gone(error)


def may_exist(path):
    """Tell whether something is there; where nobody may look, it counts as there."""
    try:
        os.stat(path)
    except OSError as error:
        return not _is_gone(error)
    return True


def in_line(path):
    """Text of a path, on one line whatever is in its name."""
    return str(path) if str(path).isprintable() else repr(str(path))


def _is_gone(error):
    return isinstance(error, (FileNotFoundError, NotADirectoryError))
