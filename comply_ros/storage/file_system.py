# SPDX-License-Identifier: Apache-2.0
"""Files: written whole or not at all, synced to the disk, and errors of paths as sentences."""

from collections.abc import Generator
from contextlib import contextmanager
import os
from pathlib import Path


class PathError(ValueError):
    """A path that cannot be used; the message is the reason, in a few words."""


@contextmanager
def path_errors() -> Generator[None, None, None]:
    """Raise whatever goes wrong with a path in the block as a `PathError`."""
    try:
        yield
    except OSError as error:
        raise PathError(reason_of(error)) from error
    except RuntimeError:  # ~USER/
        raise PathError('no such user') from None
    except UnicodeDecodeError:
        raise PathError('it is not text') from None
    except ValueError:  # a NUL, or half of a character
        raise PathError('no file can have this name') from None


def reason_of(error: OSError) -> str:
    """Return what went wrong, in a few words: `permission denied`."""
    return (error.strerror or str(error)).lower()


def printable(text: str | Path) -> str:
    """Text, or a path as text, on one line, whatever is in it."""
    text = str(text)
    return text if text.isprintable() else repr(text)


@contextmanager
def atomic_write(path: Path) -> Generator[Path, None, None]:
    """
    Give a path beside this one to write to, and rename it when the block ends without an error.

    There is never half a file. After an error the file is as it was before.
    """
    part = path.with_name(f'{path.name}.{os.getpid()}.part')
    try:
        yield part
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def write_synced(path: Path, content: bytes) -> None:
    """Write a file and sync it to the disk; raises OSError."""
    with path.open('wb') as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Sync the names in a folder to the disk; raises OSError."""
    file = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def open_truncated(path: Path, size: int) -> int:
    """Cut a file to a size; return a descriptor that writes after it. Raises OSError."""
    file = os.open(path, os.O_WRONLY | os.O_CREAT, 0o666)
    try:
        os.ftruncate(file, size)
        os.lseek(file, size, os.SEEK_SET)
    except OSError:
        os.close(file)
        raise
    return file


def is_same_file(path: Path, file: int) -> bool:
    """Whether a path still leads to an open file; also if that cannot be looked up."""
    try:
        return os.path.samestat(os.stat(path), os.fstat(file))
    except OSError as error:
        return not isinstance(error, (FileNotFoundError, NotADirectoryError))


def may_exist(path: Path) -> bool:
    """Whether a path leads anywhere; also if that cannot be looked up."""
    try:
        os.stat(path)
    except OSError as error:
        return not isinstance(error, (FileNotFoundError, NotADirectoryError))
    return True


def absolute_path(path: str) -> str:
    """Return a path that means the same file in any folder; `~` is the user's home."""
    return str(Path(path).expanduser().resolve())
