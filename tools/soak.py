# SPDX-License-Identifier: Apache-2.0
"""`scripts/soak`: the nodes learn for a long time, and their memory must not grow."""

import argparse
from collections.abc import Callable, Mapping, Sequence
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

from comply_ros.learner.learner_config import ConfigError
from comply_ros.nodes.diagnostics import process_name, TOPIC
from comply_ros.nodes.lesson_processes import running
from comply_ros.nodes.node_processes import NodeDied, NodeProcess
from comply_ros.nodes.ros_start import start_rclpy
from comply_ros.terminal.command_line import whole_number
from comply_ros.terminal.console import console, progress_bar, show_columns
from comply_ros.terminal.interrupts import check, interrupts, StopFlag
from comply_ros.terminal.standard_output import standard_output
from comply_ros.terminal.training_options import main_with, training_parser, TrainingOptions

STEPS, AFTER = 1_000_000, 50_000
WINDOW = 10_000  # steps: one reading can fall into a snapshot, the median of a window does not
GROWTH_LIMIT = 5.0  # MB
STALL_TIMEOUT = 60.0  # seconds without a step
ENDLESS = 0  # iterations
POLL_PERIOD = 0.1  # seconds
Readings = list[tuple[int, float]]  # (steps, MB) of a node, oldest first


class SoakFailed(RuntimeError):
    """A soak that did not come to an end; the message says why."""


class MemoryMonitor(Node):
    """
    Reads the memory of the nodes once a second, when the learner publishes its diagnostics.

    Parameters
    ----------
    processes: of the nodes, the learner among them.
    on_reading: called after each reading.

    Attributes
    ----------
    steps: of the learner so far.
    last_step_time: when `steps` grew last, in seconds of the monotonic clock.
    status: the last status message of the learner.
    readings: of each node, by its name.

    """

    def __init__(self, namespace: str, processes: Sequence[NodeProcess],
                 on_reading: Callable[['MemoryMonitor'], object]) -> None:
        super().__init__('soak', namespace=namespace)
        self._processes, self._on_reading = processes, on_reading
        self._learner, = (each for each in processes if each.name == 'learner')
        self.steps, self.last_step_time = 0, time.monotonic()
        self.status = 'has published no diagnostics'
        self.readings: dict[str, Readings] = {process.name: [] for process in processes}
        self.create_subscription(DiagnosticArray, TOPIC, self._on_diagnostics, 10)

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        for status in msg.status:
            if status.hardware_id != process_name(self._learner.pid):
                continue
            steps, = (int(each.value) for each in status.values if each.key == 'steps')
            if steps > self.steps:
                self.steps, self.last_step_time = steps, time.monotonic()
            self.status = status.message
            for process in self._processes:
                self.readings[process.name].append((steps, process_memory(process.pid)))
            self._on_reading(self)


def process_memory(pid: int) -> float:
    """MB (a million bytes) of a process, resident or swapped out (Linux)."""
    lines = Path(f'/proc/{pid}/status').read_text().splitlines()
    return sum(int(line.split()[1]) * 1024 / 1e6 for line in lines
               if line.startswith(('VmRSS:', 'VmSwap:')))


def memory_at_ends(readings: Readings, after: int) -> tuple[float, float]:
    """
    MB after the first steps and at the end: medians over `WINDOW` steps.

    after: steps that do not count, while caches and pools fill up.

    Raises
    ------
    SoakFailed: if one of the windows has no reading.

    """
    end = readings[-1][0] if readings else 0
    first, last = ([mb for steps, mb in readings if start <= steps < start + WINDOW]
                   for start in (after, end - WINDOW + 1))
    if not first or not last:
        raise SoakFailed(f'the memory must be read between {after:,} and {after + WINDOW:,} '
                         f'steps, got {len(readings)} readings up to {end:,}')
    return median(first), median(last)


def main(argv: Sequence[str]) -> int:
    """Run the command; return the exit code."""
    parser = training_parser('soak', 'Let the three nodes learn for a long time, and check that '
                             'their memory does not grow. Without --out no files are left.')
    add = parser.add_argument
    add('--steps', type=whole_number, default=STEPS, metavar='N', help='(default: %(default)s)')
    add('--after', type=whole_number, default=AFTER, metavar='N',
        help='number of first steps that do not count (default: %(default)s)')
    add('--stateless', action='store_false', dest='respawn',  # nodes of `--respawn` have a state
        help='run the nodes without a state_dir')
    with tempfile.TemporaryDirectory(prefix='comply_ros-soak-') as folder:
        parser.set_defaults(out=folder, namespace=f'soak_{os.getpid()}', rate=0.0)
        return main_with(parser, run, argv)


def run(options: TrainingOptions) -> int:
    """Soak the nodes, show their memory; return 0 if no node grew too much, else 1."""
    given: argparse.Namespace = options.args
    if given.iterations is not None:
        raise ConfigError('a soak ends after --steps: iterations must not be given, '
                          f'got {given.iterations}')
    if not 0 <= given.after <= given.steps - 2 * WINDOW:
        raise ConfigError(f'steps must be at least {2 * WINDOW:,} more than after, and after at '
                          f'least 0, got {given.steps:,} and {given.after:,}')
    start_rclpy(['soak'])
    try:
        with interrupts() as stop:
            endless = replace(options.config, iterations=ENDLESS)
            readings = soak(replace(options, config=endless), stop)
        return show_growth(readings, given.after)
    except (NodeDied, SoakFailed) as failure:
        print(f'soak: {failure}', file=sys.stderr)
        return 1
    finally:
        rclpy.try_shutdown()


def soak(options: TrainingOptions, stop: StopFlag) -> dict[str, Readings]:
    """
    Let the nodes learn for `--steps` steps; return the readings of each node.

    Raises
    ------
    SoakFailed: if there is no step for `STALL_TIMEOUT`.

    """
    steps, start = options.args.steps, time.monotonic()
    with progress_bar() as bar, running(options) as processes:
        task = bar.add_task(options.method, total=steps, now='starts')
        monitor = MemoryMonitor(options.args.namespace, processes, lambda monitor: bar.update(
            task, completed=min(monitor.steps, steps),
            now='  '.join(f'{each[-1][1]:.1f}' for each in monitor.readings.values()) + ' MB'))
        executor = SingleThreadedExecutor()
        executor.add_node(monitor)
        while monitor.steps < steps:
            check(stop)
            for process in processes:
                process.check()
            executor.spin_once(timeout_sec=POLL_PERIOD)
            if time.monotonic() - monitor.last_step_time > STALL_TIMEOUT:
                raise SoakFailed(f'the learner has taken no step for {STALL_TIMEOUT:g} s, after '
                                 f'{monitor.steps:,} steps; its status: {monitor.status}')
    seconds = time.monotonic() - start
    console.print(f'{monitor.steps:,} steps in {seconds:,.0f} s, '
                  f'{monitor.steps / seconds:,.0f} a second')
    return monitor.readings


def show_growth(readings: Mapping[str, Readings], after: int) -> int:
    """Show the memory of each node; return 0 if none grew too much, else 1."""
    rows, grown = [], []
    for name in readings:
        first, last = memory_at_ends(readings[name], after)
        rows.append((name, f'{first:.2f}', f'{last:.2f}', f'{last - first:+.2f}'))
        if last - first >= GROWTH_LIMIT:
            grown.append(f'{name} must grow by less than {GROWTH_LIMIT:g} MB, and grew by '
                         f'{last - first:.2f}')
    show_columns(('node', f'MB after {after:,} steps', 'MB at the end', 'growth'), rows)
    console.print('; '.join(grown) or f'Passed: no node grew by {GROWTH_LIMIT:g} MB.')
    return 1 if grown else 0


if __name__ == '__main__':
    with standard_output():
        sys.exit(main(sys.argv))
