# SPDX-License-Identifier: Apache-2.0
"""A terminal that gives single keys, shows one page, and is restored at the end."""

from collections.abc import Sequence
from contextlib import ExitStack, suppress
import os
import signal
import sys
import textwrap
from typing import Any

from prompt_toolkit.input.vt100 import Vt100Input
from prompt_toolkit.keys import Keys
from prompt_toolkit.output import ColorDepth, create_output

KEYS = {Keys.Left: 'left', Keys.Right: 'right', Keys.Down: 'down', Keys.Up: 'up',
        Keys.ControlI: '\t', Keys.ControlC: 'ctrl-c', Keys.ControlZ: 'ctrl-z'}
SIGNALS = {'ctrl-c': signal.SIGINT, 'ctrl-z': signal.SIGTSTP}  # as a terminal sends them itself


class TerminalError(ValueError):
    """Input or output is not a terminal; the message says which."""


def wrapped(text: str, columns: int) -> list[str]:
    """Lines of a text that are not longer than `columns`; at least one."""
    return textwrap.wrap(text, max(1, columns)) or ['']


def wrapped_items(items: Sequence[str], columns: int) -> list[str]:
    """Lines of items with three blanks between them; a line ends between two of them."""
    lines = ['']
    for item in items:
        longer = f'{lines[-1]}   {item}' if lines[-1] else item
        if len(longer) <= columns or not lines[-1]:
            lines[-1] = longer
        else:
            lines.append(item)
    return [each for line in lines for each in wrapped(line, columns)]


class Terminal:
    """
    The terminal of this process, taken over from `open` to `close`; raises TerminalError.

    Ctrl-Z gives it back to the shell; with `fg` it is taken over again.

    Attributes
    ----------
    has_color: whether colors can be shown: not with NO_COLOR, nor where there are none.

    """

    def __init__(self) -> None:
        for name, stream in (('input', sys.stdin), ('output', sys.stdout)):
            if stream is None or not stream.isatty():
                raise TerminalError(f'the {name} must be a terminal, and is none: run it in a '
                                    'terminal of its own')
        self._input, self._output = Vt100Input(sys.stdin), create_output(sys.stdout)
        self.has_color = self._output.get_default_color_depth() != ColorDepth.DEPTH_1_BIT
        self._restore = ExitStack()
        self._shown: Sequence[str] | None = None

    def open(self) -> None:
        """Show an empty page, and turn off echo and line editing."""
        for number, handler in ((signal.SIGTSTP, self._stop), (signal.SIGCONT, self._continue)):
            self._restore.callback(signal.signal, number, signal.signal(number, handler))
        self._restore.callback(self._hide)
        self._restore.enter_context(self._input.raw_mode())
        self._show()

    def close(self) -> None:
        """Restore the terminal; do nothing if it is closed already."""
        self._restore.close()

    def read_keys(self) -> list[str]:
        """
        Keys pressed since the last call.

        An arrow key is 'left', 'right', 'down' or 'up', any other key its character; others are
        skipped. Ctrl-C and Ctrl-Z send their signals.

        Raises
        ------
        EOFError: if the terminal is gone.

        """
        pressed = self._input.read_keys()
        if not pressed and (self._input.closed or not os.isatty(self._input.fileno())):
            raise EOFError('the terminal is gone')
        keys = [KEYS.get(each.key, each.key) for each in pressed]  # type: ignore[call-overload]
        for key in keys:
            if key in SIGNALS:
                os.kill(0, SIGNALS[key])  # to all that the shell started with us
        return [key for key in keys if len(key) == 1 or key in ('left', 'right', 'down', 'up')]

    def size(self) -> tuple[int, int]:
        """Return columns and rows."""
        size = self._output.get_size()
        return size.columns, size.rows

    def show(self, lines: Sequence[str]) -> None:
        """Show a page, if it differs from the one that is shown."""
        if lines != self._shown:
            self._shown = lines
            self._output.write_raw(
                '\x1b[H' + '\r\n'.join(f'{line}\x1b[K' for line in lines) + '\x1b[J')
            self._output.flush()

    def redraw(self) -> None:
        """Have the next page written in any case: other output may have overwritten this one."""
        self._shown = None

    def _show(self) -> None:
        self._output.enter_alternate_screen()
        self._output.hide_cursor()
        self._output.disable_autowrap()
        self._output.flush()
        self.redraw()

    def _hide(self) -> None:
        with suppress(OSError):  # the terminal is gone: there is nothing to restore
            self._output.enable_autowrap()
            self._output.show_cursor()
            self._output.quit_alternate_screen()
            self._output.flush()

    def _stop(self, *_: Any) -> None:
        """Give the terminal back, stop until `fg`, and take the terminal over again."""
        self._restore.close()
        signal.raise_signal(signal.SIGTSTP)  # which no handler catches now
        self.open()

    def _continue(self, *_: Any) -> None:
        """Take the terminal over after a stop that no handler saw: others have used it."""
        self._restore.close()
        self.open()
