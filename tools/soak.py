# SPDX-License-Identifier: Apache-2.0
"""`scripts/soak`: the nodes learn for a long time, and must not hold more memory for it."""

from dataclasses import replace
import os
from pathlib import Path
from statistics import median
import sys
import tempfile
import time

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from comply_ros.learner.learner_config import ConfigError
from comply_ros.nodes.diagnostics import process_name, TOPIC
from comply_ros.nodes.lesson import running
from comply_ros.nodes.node_processes import NodeDied
from comply_ros.nodes.spin import POLL_PERIOD
from comply_ros.terminal.console import console, progress_bar, show_columns
from comply_ros.terminal.interrupts import check, interrupts
from comply_ros.terminal.training_options import main_with, training_parser

STEPS, AFTER = 1_000_000, 50_000
WINDOW = 10_000  # steps: a single reading can catch a snapshot in the making, their median not
MOST = 5.0  # MB that a node may grow
STILL = 60.0  # seconds without a step after which something is wrong
ENDLESS = 0  # iterations


class SoakFailed(RuntimeError):
    """A soak that came to no end; the message says why."""


class Gauge(Node):
    """
    Reads the memory of the nodes once a second, when the learner says how it is.

    Parameters
    ----------
    namespace: of this node.
    processes: of the nodes, the learner among them.
    tell: called after each reading.

    Attributes
    ----------
    steps: of the learner so far.
    moved: when it was first heard to have taken them, in seconds of the monotonic clock.
    words: what it says of itself.
    readings: `readings[name]`: list of (steps, MB) of a node, oldest first.

    """

    def __init__(self, namespace, processes, tell):
        super().__init__('soak', namespace=namespace)
        self._processes, self._tell = processes, tell
        self._learner, = (each for each in processes if each.name == 'learner')
        self.steps, self.moved, self.words = 0, time.monotonic(), 'it has said nothing'
        self.readings = {process.name: [] for process in processes}
        self.create_subscription(DiagnosticArray, TOPIC, self._hear, 10)

    def _hear(self, msg):
        for status in msg.status:
            if status.hardware_id == process_name(self._learner.pid):
                steps, = (int(each.value) for each in status.values if each.key == 'steps')
                self._read(steps, status.message)

    def _read(self, steps, words):
        if steps > self.steps:
            self.steps, self.moved = steps, time.monotonic()
        self.words = words
        for process in self._processes:
            self.readings[process.name].append((steps, memory(process.pid)))
        self._tell(self)


def memory(pid):
    """MB (a million bytes) that a process holds, resident or swapped out (Linux)."""
    lines = Path(f'/proc/{pid}/status').read_text().splitlines()
    return sum(int(line.split()[1]) * 1024 / 1e6 for line in lines
               if line.startswith(('VmRSS:', 'VmSwap:')))


def held(readings, after):
    """
    MB right after the first steps and at the end: the median over `WINDOW` steps of each.

    readings: list of (steps, MB), oldest first.
    after: steps that do not count: caches and pools fill up.

    Raises
    ------
    SoakFailed: if there is no reading in one of them.

    """
    end = readings[-1][0] if readings else 0
    windows = [[mb for steps, mb in readings if begin <= steps < begin + WINDOW]
               for begin in (after, end - WINDOW + 1)]
    if not all(windows):
        raise SoakFailed(f'the memory must be read between {after:,} and {after + WINDOW:,} '
                         f'steps, got {len(readings)} readings up to {end:,}')
    return tuple(median(window) for window in windows)


def main(argv):
    """Run the command; return the exit code."""
    parser = training_parser('soak', 'Let the three nodes learn for long, and see that none of '
                            'them holds more memory for it. Nothing is left, unless --out says '
                            'where.')
    add = parser.add_argument
    add('--steps', type=int, default=STEPS, metavar='N', help='(default: %(default)s)')
    add('--after', type=int, default=AFTER, metavar='N',
        help='so many first steps do not count (default: %(default)s)')
    add('--stateless', action='store_false', dest='respawn',  # nodes of `--respawn` keep a state
        help='without a state_dir, in which the nodes otherwise keep what they learn')
    with tempfile.TemporaryDirectory(prefix='comply_ros-soak-') as folder:
        parser.set_defaults(out=folder, namespace=f'soak_{os.getpid()}', rate=0.0)
        return main_with(parser, run, argv)


def run(options):
    """Soak the nodes, show what they held; return 0 if none grew too much, else 1."""
    given = options.args
    if given.iterations is not None:
        raise ConfigError(f'a soak goes on for --steps: iterations must not be given, '
                          f'got {given.iterations}')
    if not 0 <= given.after <= given.steps - 2 * WINDOW:
        raise ConfigError(f'steps must be at least {2 * WINDOW:,} more than after, and after at '
                          f'least 0, got {given.steps:,} and {given.after:,}')
    rclpy.init(args=['soak'], signal_handler_options=SignalHandlerOptions.NO)
    try:
        with interrupts() as stop:
            readings = soak(replace(options, config=replace(
                options.config, iterations=ENDLESS)), stop)
        return verdict(readings, given.after)
    except (NodeDied, SoakFailed) as failure:
        print(f'soak: {failure}', file=sys.stderr)
        return 1
    finally:
        rclpy.try_shutdown()


def soak(options, stop):
    """Return `readings[name]` of the nodes, which learn for `--steps` steps."""
    steps, begun = options.args.steps, time.monotonic()
    with progress_bar() as bar, running(options) as processes:
        task = bar.add_task(options.method, total=steps, now='starts')
        gauge = Gauge(options.args.namespace, processes, lambda gauge: bar.update(
            task, completed=min(gauge.steps, steps), now=words(gauge.readings)))
        executor = SingleThreadedExecutor()
        executor.add_node(gauge)
        while gauge.steps < steps:
            check(stop)
            for process in processes:
                process.check()
            executor.spin_once(timeout_sec=POLL_PERIOD)
            check_moves(gauge)
    seconds = time.monotonic() - begun
    console.print(f'{gauge.steps:,} steps in {seconds:,.0f} s, '
                  f'{gauge.steps / seconds:,.0f} a second')
    return gauge.readings


def check_moves(gauge):
    """
    Return if the learner goes on.

    Raises
    ------
    SoakFailed: if it has taken no step for long.

    """
    if time.monotonic() - gauge.moved > STILL:
        raise SoakFailed(f'the learner has taken no step for {STILL:g} s, after {gauge.steps:,} '
                         f'steps; it: {gauge.words}')


def words(readings):
    """Phrase for the progress bar: what the nodes hold now, in their order."""
    return '  '.join(f'{values[-1][1]:.1f}' for values in readings.values()) + ' MB'


def verdict(readings, after):
    """Show the table of what each node held; return 0 if none grew too much, else 1."""
    rows, grown = [], []
    for name in readings:
        first, last = held(readings[name], after)
        rows.append((name, f'{first:.2f}', f'{last:.2f}', f'{last - first:+.2f}'))
        if last - first >= MOST:
            grown.append(f'{name} must grow by less than {MOST:g} MB, and grew by '
                         f'{last - first:.2f}')
    show_columns(('node', f'MB after {after:,} steps', 'MB at the end', 'growth'), rows)
    console.print('; '.join(grown) or f'It held: no node grew by {MOST:g} MB.')
    return 1 if grown else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv))
