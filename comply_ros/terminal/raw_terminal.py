# SPDX-License-Identifier: Apache-2.0
"""A terminal that gives single keys and shows one page, and is left as it was found."""

import os
import re
import select
import sys
import termios

ESCAPE = re.compile(r'\x1b(?:\[[0-9;]*[A-Za-z~]|O[A-Z])')
PART_OF_ESCAPE = re.compile(r'\x1b(?:\[[0-9;]*|O)?')
ARROWS = {'D': 'left', 'C': 'right', 'B': 'down', 'A': 'up'}
OPEN, CLOSE = '\x1b[?1049h\x1b[?25l', '\x1b[?25h\x1b[?1049l'  # a page of its own, no cursor


class TerminalError(ValueError):
    """No terminal to read keys from; the message says so."""


def keys_of(text):
    """
    Return the keys in what a terminal sent, and what is left: the beginning of an escape sequence.

    An arrow key is 'left', 'right', 'down' or 'up', every other key its character; other sequences
    are passed over.
    """
    keys = []
    while text:
        sequence = ESCAPE.match(text)
        if sequence:
            keys.append(ARROWS.get(sequence[0][-1]))
        elif PART_OF_ESCAPE.fullmatch(text):
            break
        elif text[0] != '\x1b':
            keys.append(text[0])
        text = text[len(sequence[0]) if sequence else 1:]
    return [key for key in keys if key], text


class Terminal:
    """
    The terminal of this process, from `open` to `close`.

    Raises
    ------
    TerminalError: if input or output is none.

    """

    def __init__(self):
        self._before, self._shown, self._text = None, None, ''
        for name, stream in (('input', sys.stdin), ('output', sys.stdout)):
            if stream is None or not stream.isatty():
                raise TerminalError(f'the {name} must be a terminal, for its keys and its page, '
                                    'and is none: run it in a terminal of its own')
        self._input, self._output = sys.stdin.fileno(), sys.stdout.fileno()

    def open(self):
        """Take over the terminal: no echo, no lines, no Ctrl-S and Ctrl-Z; Ctrl-C is heard."""
        self._before = termios.tcgetattr(self._input)
        ours = termios.tcgetattr(self._input)
        ours[0] &= ~termios.IXON
        ours[3] &= ~(termios.ECHO | termios.ICANON)
        ours[6][termios.VMIN], ours[6][termios.VTIME] = 1, 0
        ours[6][termios.VSUSP] = b'\0'
        termios.tcsetattr(self._input, termios.TCSAFLUSH, ours)
        self._write(OPEN)

    def close(self):
        """Leave the terminal as it was found; nothing where it is closed already."""
        before, self._before = self._before, None
        if before is None:
            return
        try:
            self._write(CLOSE)
            termios.tcsetattr(self._input, termios.TCSAFLUSH, before)
        except (OSError, termios.error):  # it hung up: nothing is left to be restored
            return

    def keys(self):
        """
        Return the keys that were pressed since, without waiting.

        Raises
        ------
        EOFError: if the terminal hung up.

        """
        if not select.select([self._input], [], [], 0)[0]:
            return []
        try:
            sent = os.read(self._input, 1024)
        except OSError:
            sent = b''
        if not sent:
            raise EOFError('the terminal hung up')
        keys, self._text = keys_of(self._text + sent.decode(errors='ignore'))
        return keys

    def size(self):
        """Return columns and rows."""
        return os.get_terminal_size(self._output)

    def show(self, lines):
        """Show a page, if it is another than before."""
        if lines != self._shown:
            self._shown = lines
            self._write('\x1b[H' + '\r\n'.join(f'{line}\x1b[K' for line in lines) + '\x1b[J')

    def show_again(self):
        """Forget what is shown: somebody may have written over it."""
        self._shown = None

    def _write(self, text):
        content = text.encode()
        while content:
            content = content[os.write(self._output, content):]
