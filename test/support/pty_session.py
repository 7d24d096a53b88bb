# SPDX-License-Identifier: Apache-2.0
"""An executable in a pseudo-terminal of the test, which types and reads there."""

from contextlib import contextmanager
import os
import pty
import re
import subprocess
import sys
import termios

from waiting import wait_until

from comply_ros.nodes.node_processes import START

CODES = re.compile(r'\x1b\[[0-9;?]*[A-Za-z]')


class PtySession:
    """
    A pseudo-terminal with an executable in it.

    Attributes
    ----------
    terminal: descriptor of the side that the executable uses.
    before: its attributes before the executable started.
    text: all that was shown.

    """

    def __init__(self, *arguments, executable='teleop_mentor', columns=120, rows=40,
                 **environment):
        self._user, self.terminal = pty.openpty()
        termios.tcsetwinsize(self.terminal, (rows, columns))
        self.before, self.text = termios.tcgetattr(self.terminal), ''
        os.set_blocking(self._user, False)
        self.process = subprocess.Popen(
            [sys.executable, '-c', START.format(executable), *arguments],
            stdin=self.terminal, stdout=self.terminal, stderr=self.terminal,
            process_group=0, env={**os.environ, **environment})

    def type(self, keys):
        """Press keys."""
        os.write(self._user, keys.encode())

    def read(self):
        """Return all that was shown so far."""
        try:
            self.text += os.read(self._user, 1_000_000).decode(errors='replace')
        except BlockingIOError:
            pass
        return self.text

    def page(self):
        """Return the page that is shown now, as text."""
        return CODES.sub('', self.read().rpartition('\x1b[H')[2])

    def wait_for(self, text):
        """Wait until the page has a text."""
        try:
            wait_until(lambda: text in self.page(), f'{text!r} on the page')
        except AssertionError as error:
            raise AssertionError(f'{error}, but\n{self.page()}') from None

    def end(self):
        """Wait for the node to end; return its exit code, and whether the terminal is restored."""
        wait_until(lambda: self.read() is None or self.process.poll() is not None, 'end')
        self.read()
        return self.process.wait(), termios.tcgetattr(self.terminal) == self.before

    def close(self):
        """End what is left."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self._user)
        os.close(self.terminal)


@contextmanager
def pty_session(*arguments, **settings):
    """Give a `PtySession`; settings: its keywords, and variables of its environment."""
    session = PtySession(*arguments, **settings)
    try:
        yield session
    finally:
        session.close()
