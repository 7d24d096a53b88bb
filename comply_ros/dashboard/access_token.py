# SPDX-License-Identifier: Apache-2.0
"""Where the token of the page comes from: an environment variable, a file, or a random number."""

from contextlib import suppress
import os
from pathlib import Path
import re
import secrets
import stat
import sys

from comply_ros.dashboard.access_control import LOCAL_HOSTS, MIN_TOKEN_LENGTH
from comply_ros.nodes.parameters import ParameterError
from comply_ros.storage.file_system import path_errors, PathError, printable

VARIABLE = 'COMPLY_ROS_TOKEN'  # environment variable with the token
TERMINAL = '/dev/tty'  # of this process, wherever its output goes
MAX_TOKEN_LENGTH = 500


def page_token(address: str, token_file: str) -> tuple[str, bool]:
    """
    Return the token that the page asks for, '' for none, and whether it was made just now.

    The environment variable counts more than the file. A file that does not exist is created,
    with a random token. Without both, a random token is made where other machines reach the page.

    Raises ParameterError for a file that others may read, and for a token that is easily guessed.
    """
    given = os.environ.get(VARIABLE, '')
    if given:
        return _checked(given, f'environment variable {VARIABLE}'), False
    if token_file:
        return _checked(_read(token_file), f'token_file {token_file!r}'), False
    return ('', False) if address in LOCAL_HOSTS else (secrets.token_urlsafe(16), True)


def print_token(url: str) -> None:
    """
    Print a URL with a token on the terminal, where no log file and no other program gets it.

    Raises ParameterError where there is no terminal.
    """
    line = f'{url}\n'
    if sys.stderr.isatty():
        sys.stderr.write(line)
        sys.stderr.flush()
        return
    try:
        terminal = os.open(TERMINAL, os.O_WRONLY | os.O_NOCTTY)
    except OSError:
        raise ParameterError(
            'parameter token_file must name a file where other machines reach the page and no '
            "terminal can show a token, got ''") from None
    try:
        os.write(terminal, line.encode())
    finally:
        os.close(terminal)


def _read(token_file: str) -> str:
    """Return the token in a file of mode 600; a file that does not exist is created."""
    try:
        with path_errors():
            path = Path(token_file).expanduser()
            with suppress(FileExistsError):
                file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
                os.write(file, f'{secrets.token_urlsafe(16)}\n'.encode())
                os.close(file)
            with path.open('rb') as opened:
                mode = stat.S_IMODE(os.fstat(opened.fileno()).st_mode)
                content = opened.read(MAX_TOKEN_LENGTH + 1).decode('utf-8-sig')
    except PathError as error:
        raise ParameterError(f'parameter token_file must be a file that can be read, got '
                             f'{token_file!r} ({error})') from None
    if mode & 0o077:
        raise ParameterError(f'parameter token_file must be a file that only you may read, got '
                             f'{token_file!r} of mode {mode:o}: chmod 600 {printable(path)}')
    return content.strip()


def _checked(token: str, source: str) -> str:
    """Return a token; raises ParameterError, without the token, for one that is invalid."""
    if not re.fullmatch(rf'[\w.-]{{{MIN_TOKEN_LENGTH},{MAX_TOKEN_LENGTH}}}', token, re.ASCII):
        raise ParameterError(f'the token in {source} must have at least {MIN_TOKEN_LENGTH} '
                             f'letters, digits, _, . or -, got {len(token)} characters')
    return token
