# SPDX-License-Identifier: Apache-2.0
"""`lesson`: starts the three nodes as processes, watches them, and ends them with results."""

import argparse
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager, nullcontext
import fcntl
import os
from pathlib import Path
import sys
import tempfile
import time
from typing import Any, NamedTuple

from numpy.typing import NDArray
import rclpy
from rclpy.executors import SingleThreadedExecutor

from comply_ros.learner.learner_config import ConfigError
from comply_ros.nodes.external_node import (
    external_world,
    find_external,
    in_external_world,
    PARTS,
    with_external,
)
from comply_ros.nodes.lesson_processes import ros_namespace, running
from comply_ros.nodes.lesson_watch import LessonWatch, TAKEN
from comply_ros.nodes.node_processes import NodeDied, NodeProcess
from comply_ros.nodes.parameters import FASTEST, SLOWEST
from comply_ros.nodes.ros_start import RosStartError, start_rclpy
from comply_ros.nodes.run_monitor import LessonFailed, RunMonitor
from comply_ros.nodes.spin import POLL_PERIOD
from comply_ros.protocol.iteration_counter import IterationCounter
from comply_ros.storage.learning_file import read_learning
from comply_ros.terminal.command_line import real_number
from comply_ros.terminal.interrupts import check, interrupts, StopFlag
from comply_ros.terminal.training_options import (
    guarded,
    main_with,
    training_parser,
    TrainingOptions,
)
from comply_ros.world.mdp import World
from comply_ros.world.reference_returns import AnyReturns, reference_returns

DISCOVERY = 0.5  # seconds in which most other nodes on the same topics are found
DISCOVERY_WITH_RESPAWN = 1.0  # as long, where those that are found later are not known as others


class LessonResults(NamedTuple):
    """
    What a lesson has found out.

    Attributes
    ----------
    options: those of the lesson, with what an external node brought.
    reference: returns of the world.
    advice: that of the mentor, None where an external one did not publish it.
    outcome: arguments of `summarize`.

    """

    options: TrainingOptions
    reference: AnyReturns
    advice: NDArray[Any] | None
    outcome: dict[str, Any]


# Called with the processes: a context in which they learn, as `tools/chaos.py` has one.
Disturbance = Callable[[list[NodeProcess]], AbstractContextManager[None]]


def lesson_parser(program: str = 'lesson',
                  description: str = 'Teach a learner over topics, in three processes.',
                  **own: str) -> argparse.ArgumentParser:
    """Return a parser of the options of a lesson; arguments as `training_parser`."""
    parser = training_parser(program, description, **own)
    parser.add_argument('--namespace', type=ros_namespace, default='', metavar='NAME',
                        help='of the three nodes, for a second lesson at the same time')
    parser.add_argument('--rate', type=_rate, default=0.0, metavar='HZ',
                        help='steps per second, to watch; 0: as fast as possible (default)')
    parser.add_argument('--external', choices=tuple(PARTS), default='', metavar='PART',
                        help='world, mentor or learner: do not start it, but find the one that '
                        'runs on these topics')
    parser.add_argument('--respawn', action='store_true',
                        help='start a node again that was killed: nothing is lost')
    return parser


def _rate(text: str) -> float:
    rate = real_number(text)
    if rate and not SLOWEST <= rate <= FASTEST:
        raise argparse.ArgumentTypeError(
            f'it must be 0 or lie in [{SLOWEST}, {FASTEST}], got {text}')
    return rate


def main(argv: list[str]) -> int:
    """Run the command; return the exit code."""
    return main_of(lesson_parser(), argv)


def main_of(parser: argparse.ArgumentParser, argv: list[str]) -> int:
    """Run a lesson by the options of a `lesson_parser`; return the exit code."""
    return guarded(parser.prog, (RosStartError,), lambda: main_with(
        parser, lambda options: run(options, parser.prog), argv))


def run(options: TrainingOptions, program: str) -> int:
    """Run the lesson of a program, write the results, return the exit code."""
    try:
        results = run_lesson(options)
    except (NodeDied, LessonFailed) as failure:
        print(f'{program}: {failure}', file=sys.stderr)
        return 1
    from comply_ros.terminal.run_report import plot_here, report_training
    options, reference, advice, outcome = results
    report_training(options, options.out, reference, advice, [outcome], plot_here)
    return 0


def run_lesson(options: TrainingOptions, disturbance: Disturbance = lambda _: nullcontext(),
               ) -> LessonResults:
    """
    Return what a lesson has found out.

    The processes start at once, but make their nodes only when no other nodes are found on the
    topics of the lesson: loading, planning and discovery take their time together. Other nodes
    that are found before the first iteration end the lesson; with `--respawn` they cannot be told
    from killed ones. Those that start later become inactive, as they do beside any run.

    Raises NodeDied or LessonFailed if there is no outcome, PlanningError for a world without a
    shortest way to its goal.
    """
    start_rclpy(['lesson', '--ros-args', '--enclave', '/lesson'])
    try:
        with interrupts() as stop, lock_topics(options.args.namespace):
            monitor, options = _monitor(options, stop)
            discovered = time.monotonic() + (  # from when there is a node to discover
                DISCOVERY_WITH_RESPAWN if options.args.respawn else DISCOVERY)
            with running(options, held=True) as monitor.processes:
                return _start_and_watch(options, monitor, discovered, stop, disturbance)
    finally:
        rclpy.try_shutdown()


def _monitor(options: TrainingOptions, stop: StopFlag) -> tuple[RunMonitor, TrainingOptions]:
    """Return the monitor of a lesson, and its options in the world that an external node has."""
    external, namespace = options.args.external, options.args.namespace
    if external == 'mentor' and options.args.mentors:
        raise ConfigError('an external mentor must be the only one of a lesson, got --mentors too')
    mentors = tuple(options.spec.by_name())
    if external == 'world':
        msg = external_world(namespace, lambda: check(stop))
        options = in_external_world(options, msg)
        monitor = RunMonitor(namespace, options.source, external, mentors=mentors)
        monitor.own_run = msg.run
        return monitor, options
    counter = IterationCounter(options.config.iterations, options.config.episodes) \
        if external == 'learner' else None
    return RunMonitor(namespace, options.source, external, counter, mentors), options


def _start_and_watch(options, monitor, discovered, stop, disturbance):
    from comply_ros.nodes.background_thread import in_background  # these load while the nodes load
    from comply_ros.terminal.console import iteration_status, progress_bar
    plan = in_background(reference_returns, World(options.source))
    executor = SingleThreadedExecutor()
    executor.add_node(monitor)
    with progress_bar() as bar:
        task = bar.add_task(
            options.method, total=options.config.iterations, now='looks for other nodes')
        monitor.on_progress = lambda msg: bar.update(
            task, completed=msg.iteration,
            now=iteration_status(msg.mean_return, msg.confidence, monitor.rate()))
        while (remaining := discovered - time.monotonic()) > 0.0 or not plan.done():
            executor.spin_once(timeout_sec=min(POLL_PERIOD, max(0.01, remaining)))
            check(stop)
            for process in monitor.processes:
                process.check()
            if monitor.most_publishers() > 0:
                raise LessonFailed(TAKEN)
        if options.args.external:
            name = find_external(monitor, executor, options.args.external, lambda: check(stop))
            options = with_external(options, options.args.external, name)
        reference = plan.result()
        bar.update(task, description=options.method, now='starts the nodes')
        for process in monitor.processes:
            process.release()
        with disturbance(monitor.processes):
            advice, outcome = LessonWatch(
                options, monitor, executor, stop, lambda text: bar.update(task, now=text),
                lambda text: bar.console.print(text, soft_wrap=True, markup=False)).outcome()
    file, policy_return = options.out / 'learning.npz', None
    if outcome['digest'] is not None:
        policy_return = reference.return_of(read_learning(file).policy)
    return LessonResults(options, reference, advice, {**outcome, 'policy_return': policy_return})


@contextmanager
def lock_topics(namespace: str) -> Generator[None, None, None]:
    """
    Reserve the topics of a ROS domain and namespace for one lesson on this machine.

    Raises LessonFailed if another lesson of this user has them.
    """
    name = namespace.strip('/').replace('/', '_')
    place = f'{os.getuid()}-{os.environ.get("ROS_DOMAIN_ID") or 0}-{name}'
    with open(Path(tempfile.gettempdir()) / f'comply_ros-lesson-{place}.lock', 'w') as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise LessonFailed(TAKEN) from None
        yield
