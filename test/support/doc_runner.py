# SPDX-License-Identifier: Apache-2.0
"""Runs the commands of a page in terminals and compares the output with the page."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
import os
from pathlib import Path
import pty
import re
import signal
import subprocess
import termios
from threading import Thread
from typing import BinaryIO, NamedTuple

from waiting import DEADLINE, wait_until

TERMINAL = re.compile(r'# terminal (\d+)(: Ctrl-C)?$')
SIZE = 50, 120  # rows and columns of a terminal
ESCAPES = re.compile(r'\x1b(\[[0-?]*[ -/]*[@-~]|[()].|[=>78])')  # colours, cursor, modes
# Commands that are repeated until their output is right: a node may be found late.
REPEATED = 'scripts/topic echo', 'scripts/topic list'


class Block(NamedTuple):
    """
    A fenced block of commands.

    Attributes
    ----------
    line: of the page, from 1.
    terminal: in which the command keeps running; None for commands that end.
    ends: whether the block only ends what runs in the terminal.
    commands: without comments.
    expected: lines of the ```text block that follows, () without one. A ```text block that starts
        with the mark of a terminal is a block of its own: the output that appears there later.

    """

    line: int
    terminal: str | None
    ends: bool
    commands: tuple[str, ...]
    expected: tuple[str, ...]


class Fence(NamedTuple):
    """A fenced block as it is written: its first line on the page, its language, its lines."""

    line: int
    language: str
    lines: tuple[str, ...]


def fences(text: str) -> list[Fence]:
    """Return every `Fence` of a page."""
    found: list[Fence] = []
    start = None
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith('```'):
            if start is None:
                start = number, line[3:], []
            else:
                found.append(Fence(start[0], start[1], tuple(start[2])))
                start = None
        elif start:
            start[2].append(line)
    assert start is None, f'line {start[0]} starts a block without an end'
    return found


def blocks(text: str) -> list[Block]:
    """Return every `Block` of a page."""
    found, all_fences = [], fences(text)
    for fence, after in zip(all_fences, [*all_fences[1:], None]):
        mark = TERMINAL.match(fence.lines[0])
        if fence.language == 'bash':
            has_output = after and after.language == 'text' and not TERMINAL.match(after.lines[0])
            found.append(Block(fence.line, mark and mark[1], bool(mark and mark[2]),
                               tuple(without_comments(fence.lines)),
                               after.lines if after and has_output else ()))
        elif fence.language == 'text' and mark:
            found.append(Block(fence.line, mark[1], False, (), fence.lines[1:]))
    return found


def without_comments(lines: Sequence[str]) -> Iterator[str]:
    """Yield the commands of the lines."""
    for line in lines:
        command = re.sub(r'(^|\s+)# .*', '', line).strip()
        if command:
            yield command


def pattern(expected: Sequence[str]) -> re.Pattern[str]:
    """Pattern of a text in which `...` stands for any text, and a line of it for any lines."""
    lines = [r'(?:.*\n)*?' if line.strip() == '...' else
             re.escape(line.rstrip()).replace(r'\.\.\.', '.*') + r'[ \t]*\n' for line in expected]
    return re.compile('^' + ''.join(lines), re.MULTILINE)


class EndedError(Exception):
    """A command that must keep running has ended."""


class DocRunner:
    """
    Terminals in which the blocks of a page run.

    Parameters
    ----------
    folder: in which the commands run.
    settings: environment variables.

    Attributes
    ----------
    running: the processes that keep running, by terminal.

    """

    def __init__(self, folder: Path, **settings: str) -> None:
        self._folder = Path(folder)
        self.running: dict[str, subprocess.Popen] = {}
        self._copies: dict[str, Thread] = {}  # of the output of each terminal
        self._environment = {**os.environ, 'PYTHONUNBUFFERED': '1',
                             'RCUTILS_COLORIZED_OUTPUT': '0', 'TERM': 'xterm', **settings}

    def __enter__(self) -> 'DocRunner':
        return self

    def __exit__(self, *exception: object) -> None:
        for process in self.running.values():
            interrupt(process)
        for process in self.running.values():
            process.wait(DEADLINE)

    def run(self, block: Block) -> None:
        """Run a block, and wait until the expected output is there."""
        if not block.terminal:
            self._run_to_end(block)
            return
        if block.commands or block.ends:
            self._interrupt(block.terminal)
        if block.commands:
            self._start(block, block.terminal)
        if not block.ends:
            self._wait(block, block.terminal)

    def _interrupt(self, terminal: str) -> None:
        """Type Ctrl-C if something runs in a terminal."""
        process = self.running.pop(terminal, None)
        if process is None:
            return
        interrupt(process)
        assert process.wait(DEADLINE) in (0, 130, -signal.SIGINT), self._output(terminal)

    def _start(self, block: Block, terminal: str) -> None:
        """Start a command that keeps running."""
        command, = block.commands
        our_end, its_end = pty.openpty()
        termios.tcsetwinsize(its_end, SIZE)
        self.running[terminal] = subprocess.Popen(
            ['bash', '-c', f'exec {command}'], cwd=self._folder, env=self._environment,
            stdin=its_end, stdout=its_end, stderr=its_end, start_new_session=True)
        os.close(its_end)
        log = self._log(terminal).open('wb')
        self._copies[terminal] = Thread(target=copy_output, args=(our_end, log), daemon=True)
        self._copies[terminal].start()

    def _wait(self, block: Block, terminal: str) -> None:
        """Wait until a terminal shows the expected output."""
        process = self.running[terminal]

        def is_shown() -> object:
            if process.poll() is not None:
                self._copies[terminal].join(DEADLINE)  # until all that it printed is there
                raise EndedError(f'{where(block)} ended:\n{self._output(terminal)}')
            return pattern(block.expected).search(self._output(terminal))
        try:
            wait_until(is_shown, where(block))
        except AssertionError:
            raise AssertionError(mismatch(block, self._output(terminal))) from None

    def _run_to_end(self, block: Block) -> None:
        """Run commands to their end; repeat those that show a topic until the output is right."""
        output = ''

        def is_shown() -> object:
            nonlocal output
            output = ''.join(self._output_of(command, block) for command in block.commands)
            return pattern(block.expected).search(output)
        if is_shown():
            return
        assert all(each.startswith(REPEATED) for each in block.commands), mismatch(block, output)
        try:
            wait_until(is_shown, where(block))
        except AssertionError:
            raise AssertionError(mismatch(block, output)) from None

    def _output_of(self, command: str, block: Block) -> str:
        done = subprocess.run(['bash', '-c', command], cwd=self._folder, text=True,
                              timeout=DEADLINE, env=self._environment, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, check=False, stdin=subprocess.DEVNULL)
        assert done.returncode == 0 or block.expected, f'{where(block)}:\n{done.stdout}'
        return done.stdout

    def _log(self, terminal: str) -> Path:
        return self._folder / f'terminal_{terminal}.log'

    def _output(self, terminal: str) -> str:
        text = self._log(terminal).read_text(errors='replace')
        return ESCAPES.sub('', text).replace('\r', '')


def copy_output(terminal: int, log: BinaryIO) -> None:
    """Write all output of a terminal to a file, until no process has the terminal open."""
    with log, suppress(OSError):
        while output := os.read(terminal, 65536):
            log.write(output)
            log.flush()
    os.close(terminal)


def interrupt(process: subprocess.Popen) -> None:
    """Interrupt a process and its children, as Ctrl-C does, unless it has ended."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGINT)


def where(block: Block) -> str:
    """Return the line and the commands of a block."""
    return f'line {block.line}: {" ; ".join(block.commands)}'


def mismatch(block: Block, output: str) -> str:
    """Return the error for output that is not the expected one."""
    expected = '\n'.join(block.expected)
    return f'{where(block)}\nshows\n{output}\nand not\n{expected}'
