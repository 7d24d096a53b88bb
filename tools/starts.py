# SPDX-License-Identifier: Apache-2.0
"""`scripts/starts`: start nodes that refuse a parameter, and check how their processes end."""

import argparse
from collections import Counter
from collections.abc import Sequence
from itertools import cycle, islice
import signal
import subprocess
import sys

from comply_ros.nodes.node_processes import START
from comply_ros.terminal.command_line import CommandParser, whole_number
from comply_ros.terminal.console import console, progress_bar, show_columns
from comply_ros.terminal.training_options import guarded

STARTS = 200
REFUSED = 2  # exit code of a node that refuses a parameter
TIMEOUT = 60.0  # seconds that a process has to end
# Executables, each with a value that it refuses, some early and some late in its start.
MISTAKES = (
    ('grid_world', 'rate:=-1.0'),
    ('mentor', 'mentor:=nobody'),
    ('learner', 'method:=none'),
    ('learner', 'advice_timeout:=-1.0'),
    ('viewer', 'robot_rate:=-1.0'),
    ('record', 'bag:=/'),
    ('fault_injector', 'depth:=0'),
    ('grid_world', 'map:=no.yaml'),
)


def main(argv: Sequence[str]) -> int:
    """Run the command; return the exit code."""
    parser = CommandParser('starts', description='Start nodes with a value that they refuse, one '
                           'after the other, and check that each ends with exit code '
                           f'{REFUSED}.')
    parser.add_argument('--starts', type=whole_number, default=STARTS, metavar='N',
                        help='how many, over all nodes (default: %(default)s)')
    given = parser.parse_args(argv[1:])
    if given.starts < 1:
        parser.error(f'--starts must be at least 1, got {given.starts}')
    return guarded('starts', (), lambda: run(given))


def run(given: argparse.Namespace) -> int:
    """Start the nodes, show how they ended; return 0 if all ended as they must, else 1."""
    ends: Counter[tuple[str, str]] = Counter()
    others = 0
    with progress_bar() as bar:
        task = bar.add_task('starts', total=given.starts, now='')
        for name, mistake in islice(cycle(MISTAKES), given.starts):
            process = start(name, mistake)
            ends[f'{name} {mistake}', end_text(process.returncode)] += 1
            if process.returncode != REFUSED:
                others += 1
                console.print(f'{name} {mistake}: {end_text(process.returncode)}\n'
                              f'{process.stderr.rstrip()}', markup=False)
            bar.update(task, advance=1)
    show_columns(('node', 'end', 'starts'),
                 ((*what, f'{count}') for what, count in sorted(ends.items())))
    console.print(f'{others} of {given.starts} starts must end with exit code {REFUSED}, and '
                  'ended otherwise' if others
                  else f'Passed: {given.starts} starts ended with exit code {REFUSED}.')
    return 1 if others else 0


def start(name: str, mistake: str) -> subprocess.CompletedProcess[str]:
    """Run a node with a value that it refuses to its end."""
    return subprocess.run(
        [sys.executable, '-P', '-c', START.format(name), '--ros-args', '-p', mistake],
        stdin=subprocess.DEVNULL, capture_output=True, text=True, errors='replace',
        timeout=TIMEOUT, check=False)


def end_text(code: int) -> str:
    """Text of how a process ended, by its return code as `subprocess` has it."""
    return f'exit code {code}' if code >= 0 else f'signal {signal.Signals(-code).name}'


if __name__ == '__main__':
    sys.exit(main(sys.argv))
