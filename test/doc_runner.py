# SPDX-License-Identifier: Apache-2.0
"""A page with commands, and a class that types them: terminals, Ctrl-C, and what is to be seen."""

from contextlib import suppress
import os
from pathlib import Path
import pty
import re
import signal
import subprocess
import termios
from threading import Thread
from typing import NamedTuple

from node_processes import wait_until

TERMINAL = re.compile(r'# terminal (\d+)(: Ctrl-C)?$')
SIZE = 50, 120  # rows and columns of a terminal
ESCAPES = re.compile(r'\x1b(\[[0-?]*[ -/]*[@-~]|[()].|[=>78])')  # colours, cursor, modes
AGAIN = 'scripts/topic echo'  # what a reader looks at again until it is there


class Block(NamedTuple):
    """
    A fenced block of commands.

    Attributes
    ----------
    line: of the page, from 1.
    terminal: in which they run on, None where they come to an end.
    ends: whether what runs in the terminal is ended, and nothing else happens.
    commands: without comments.
    expected: lines of the ```text block that follows, () without one. A ```text block that begins
        with the mark of a terminal is a block of its own: what is to be seen there by and by.

    """

    line: int
    terminal: str
    ends: bool
    commands: tuple
    expected: tuple


class Fence(NamedTuple):
    """A fenced block as it is written: its first line on the page, its language, its lines."""

    line: int
    language: str
    lines: tuple


def fences(text):
    """Return every `Fence` of a page."""
    found, begun = [], None
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith('```'):
            if begun is None:
                begun = number, line[3:], []
            else:
                found.append(Fence(begun[0], begun[1], tuple(begun[2])))
                begun = None
        elif begun:
            begun[2].append(line)
    assert begun is None, f'line {begun[0]} begins a block without end'
    return found


def blocks(text):
    """Return every `Block` of a page."""
    found, all_of_them = [], fences(text)
    for fence, after in zip(all_of_them, [*all_of_them[1:], None]):
        mark = TERMINAL.match(fence.lines[0])
        if fence.language == 'bash':
            is_below = after and after.language == 'text' and not TERMINAL.match(after.lines[0])
            found.append(Block(fence.line, mark and mark[1], bool(mark and mark[2]),
                               tuple(without_comments(fence.lines)),
                               after.lines if is_below else ()))
        elif fence.language == 'text' and mark:
            found.append(Block(fence.line, mark[1], False, (), fence.lines[1:]))
    return found


def without_comments(lines):
    """Yield the commands of the lines."""
    for line in lines:
        command = re.sub(r'(^|\s+)# .*', '', line).strip()
        if command:
            yield command


def pattern(expected):
    """Pattern of a text in which ... stands for anything, and a line of it for lines."""
    lines = [r'(?:.*\n)*?' if line.strip() == '...' else
             re.escape(line.rstrip()).replace(r'\.\.\.', '.*') + r'[ \t]*\n' for line in expected]
    return re.compile('^' + ''.join(lines), re.MULTILINE)


class EndedError(Exception):
    """What was to go on in a terminal has ended."""


class Class:
    """
    Terminals in which a page is typed.

    Parameters
    ----------
    folder: in which the commands run.
    settings: environment variables.

    """

    def __init__(self, folder, **settings):
        self._folder, self._running = Path(folder), {}
        self._environment = {**os.environ, 'PYTHONUNBUFFERED': '1',
                             'RCUTILS_COLORIZED_OUTPUT': '0', 'TERM': 'xterm', **settings}

    def __enter__(self):
        return self

    def __exit__(self, *problem):
        for process in self._running.values():
            interrupt(process)
        for process in self._running.values():
            process.wait(20)

    def do(self, block):
        """Do what a block says, and wait until what is expected is there."""
        if not block.terminal:
            self._run(block)
            return
        if block.commands or block.ends:
            self._interrupt(block.terminal)
        if block.commands:
            self._begin(block)
        if not block.ends:
            self._wait(block)

    def _interrupt(self, terminal):
        """Type Ctrl-C, where something runs in a terminal."""
        process = self._running.pop(terminal, None)
        if process is None:
            return
        interrupt(process)
        assert process.wait(20) in (0, 130, -signal.SIGINT), self._output(terminal)

    def _begin(self, block):
        """Type a command that goes on."""
        command, = block.commands
        ours, theirs = pty.openpty()
        termios.tcsetwinsize(theirs, SIZE)
        self._running[block.terminal] = subprocess.Popen(
            ['bash', '-c', f'exec {command}'], cwd=self._folder, env=self._environment,
            stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True)
        os.close(theirs)
        log = self._log(block.terminal).open('wb')
        Thread(target=show, args=(ours, log), daemon=True).start()

    def _wait(self, block):
        """Wait until a terminal shows what is expected."""
        process = self._running[block.terminal]

        def seen():
            msg = self._output(block.terminal)
            if process.poll() is not None:
                raise EndedError(f'{where(block)} ended:\n{msg}')
            return pattern(block.expected).search(msg)
        try:
            wait_until(seen, where(block))
        except AssertionError:
            raise AssertionError(unlike(block, self._output(block.terminal))) from None

    def _run(self, block):
        """Run commands to their end; those that look at a topic again, until it is there."""
        msg = ''

        def seen():
            nonlocal msg
            msg = ''.join(self._said_by(command, block) for command in block.commands)
            return pattern(block.expected).search(msg)
        if seen():
            return
        assert all(each.startswith(AGAIN) for each in block.commands), unlike(block, msg)
        try:
            wait_until(seen, where(block))
        except AssertionError:
            raise AssertionError(unlike(block, msg)) from None

    def _said_by(self, command, block):
        done = subprocess.run(['bash', '-c', command], cwd=self._folder, text=True, timeout=60,
                              env=self._environment, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, check=False, stdin=subprocess.DEVNULL)
        assert done.returncode == 0 or block.expected, f'{where(block)}:\n{done.stdout}'
        return done.stdout

    def _log(self, terminal):
        return self._folder / f'terminal_{terminal}.log'

    def _output(self, terminal):
        text = self._log(terminal).read_text(errors='replace')
        return ESCAPES.sub('', text).replace('\r', '')


def show(terminal, log):
    """Write all that a terminal shows to a file, until nobody has it any more."""
    with log, suppress(OSError):
        while shown := os.read(terminal, 65536):
            log.write(shown)
            log.flush()
    os.close(terminal)


def interrupt(process):
    """Type Ctrl-C, which all hear that the process started, unless it has ended."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGINT)


def where(block):
    """Name of a block, for a reader of the page."""
    return f'line {block.line}: {" ; ".join(block.commands)}'


def unlike(block, msg):
    """Sentence for what was not to be seen."""
    expected = '\n'.join(block.expected)
    return f'{where(block)}\nshows\n{msg}\nand not\n{expected}'
