# SPDX-License-Identifier: Apache-2.0
"""Somebody who types in a terminal of the test's own."""

from contextlib import contextmanager
import os
import pty
import re
import subprocess
import sys
import termios

from node_processes import wait_until

from comply_ros.nodes.node_processes import START

CODES = re.compile(r'\x1b\[[0-9;?]*[A-Za-z]')


class Typist:
    """
    A terminal with `teleop_mentor` in it, and who types there.

    Attributes
    ----------
    theirs: descriptor of the terminal.
    before: what it was set to before.
    text: all that was shown.

    """

    def __init__(self, *arguments):
        self._ours, theirs = pty.openpty()
        termios.tcsetwinsize(theirs, (40, 120))
        self.before = termios.tcgetattr(theirs)
        self.theirs, self.text = theirs, ''
        os.set_blocking(self._ours, False)
        self.process = subprocess.Popen(
            [sys.executable, '-c', START.format('teleop_mentor'), *arguments], stdin=theirs,
            stdout=theirs, stderr=theirs, start_new_session=True)

    def type(self, keys):
        """Press keys."""
        os.write(self._ours, keys.encode())

    def read(self):
        """Return all that was shown so far."""
        try:
            self.text += os.read(self._ours, 1_000_000).decode(errors='replace')
        except BlockingIOError:
            pass
        return self.text

    def page(self):
        """Return the page that is shown now, as text."""
        return CODES.sub('', self.read().rpartition('\x1b[H')[2])

    def sees(self, text):
        """Wait until the page has a text."""
        try:
            wait_until(lambda: text in self.page(), f'{text!r} on the page')
        except AssertionError as error:
            raise AssertionError(f'{error}, but\n{self.page()}') from None

    def end(self):
        """Return the exit code, and whether the terminal is as it was."""
        wait_until(lambda: self.read() is None or self.process.poll() is not None, 'end')
        self.read()
        return self.process.wait(), termios.tcgetattr(self.theirs) == self.before

    def close(self):
        """End what is left."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self._ours)
        os.close(self.theirs)


@contextmanager
def typist(*arguments):
    """Give a `Typist`."""
    person = Typist(*arguments)
    try:
        yield person
    finally:
        person.close()
