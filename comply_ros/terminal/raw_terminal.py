# SPDX-License-Identifier: Apache-2.0
"""A terminal that gives single keys, shows one page, and is restored at the end."""

from collections.abc import Sequence
import os
import re
import select
import sys
import termios

ESCAPE = re.compile(r'\x1b(?:\[[0-9;]*[A-Za-z~]|O[A-Z])')
PART_OF_ESCAPE = re.compile(r'\x1b(?:\[[0-9;]*|O)?')
ARROW_KEYS = {'D': 'left', 'C': 'right', 'B': 'down', 'A': 'up'}
OPEN, CLOSE = '\x1b[?1049h\x1b[?25l', '\x1b[?25h\x1b[?1049l'  # the alternate screen, no cursor


class TerminalError(ValueError):
    """Input or output is not a terminal; the message says which."""


def keys_of(text: str) -> tuple[list[str], str]:
    """
    Return the keys in a terminal's input, and the unfinished escape sequence at its end.

    An arrow key is 'left', 'right', 'down' or 'up', any other key its character; other escape
    sequences are skipped.
    """
    keys = []
    while text:
        sequence = ESCAPE.match(text)
        if sequence:
            keys.append(ARROW_KEYS.get(sequence[0][-1]))
        elif PART_OF_ESCAPE.fullmatch(text):
            break
        elif text[0] != '\x1b':
            keys.append(text[0])
        text = text[len(sequence[0]) if sequence else 1:]
    return [key for key in keys if key], text


class Terminal:
    """The terminal of this process, taken over from `open` to `close`; raises TerminalError."""

    def __init__(self) -> None:
        self._restored_to: list | None = None
        self._shown: Sequence[str] | None = None
        self._unfinished = ''
        for name, stream in (('input', sys.stdin), ('output', sys.stdout)):
            if stream is None or not stream.isatty():
                raise TerminalError(f'the {name} must be a terminal, and is none: run it in a '
                                    'terminal of its own')
        self._input, self._output = sys.stdin.fileno(), sys.stdout.fileno()

    def open(self) -> None:
        """Turn off echo, line editing, Ctrl-S and Ctrl-Z; Ctrl-C still interrupts."""
        self._restored_to = termios.tcgetattr(self._input)
        raw = termios.tcgetattr(self._input)
        raw[0] &= ~termios.IXON
        raw[3] &= ~(termios.ECHO | termios.ICANON)
        raw[6][termios.VMIN], raw[6][termios.VTIME] = 1, 0
        raw[6][termios.VSUSP] = b'\0'
        termios.tcsetattr(self._input, termios.TCSAFLUSH, raw)
        self._write(OPEN)

    def close(self) -> None:
        """Restore the terminal; do nothing if it is closed already."""
        before, self._restored_to = self._restored_to, None
        if before is None:
            return
        try:
            self._write(CLOSE)
            termios.tcsetattr(self._input, termios.TCSAFLUSH, before)
        except (OSError, termios.error):  # the terminal is gone: there is nothing to restore
            return

    def read_keys(self) -> list[str]:
        """Return the keys pressed since the last call; raises EOFError if the terminal is gone."""
        if not select.select([self._input], [], [], 0)[0]:
            return []
        try:
            received = os.read(self._input, 1024)
        except OSError:
            received = b''
        if not received:
            raise EOFError('the terminal is gone')
        keys, self._unfinished = keys_of(self._unfinished + received.decode(errors='ignore'))
        return keys

    def size(self) -> os.terminal_size:
        """Return columns and rows."""
        return os.get_terminal_size(self._output)

    def show(self, lines: Sequence[str]) -> None:
        """Show a page, if it differs from the one that is shown."""
        if lines != self._shown:
            self._shown = lines
            self._write('\x1b[H' + '\r\n'.join(f'{line}\x1b[K' for line in lines) + '\x1b[J')

    def redraw(self) -> None:
        """Have the next page written in any case: other output may have overwritten this one."""
        self._shown = None

    def _write(self, text: str) -> None:
        content = text.encode()
        while content:
            content = content[os.write(self._output, content):]
