# SPDX-License-Identifier: Apache-2.0
"""How a node starts, spins and ends, with every error on one line."""

from collections.abc import Callable
import gc
from itertools import takewhile
import os
from pathlib import Path
from select import select
import signal
import sys
from typing import Any

import rclpy
from rclpy.experimental import EventsExecutor

from comply_ros.nodes.node_help import help_text
from comply_ros.nodes.parameter_node import destroy_nodes
from comply_ros.nodes.ros_start import RosStartError, start_rclpy
from comply_ros.terminal.interrupts import interrupts, StopFlag

HOLD = 'COMPLY_ROS_HOLD'  # environment variable: start when a byte comes on standard input
POLL_PERIOD = 0.1  # seconds between two checks for Ctrl-C
GARBAGE_THRESHOLD = 20_000  # new objects before a collection: 700 cost a learner 3 microseconds
SHUTDOWN_TIMEOUT = 5  # seconds that rclpy has to shut down; then the kernel ends the process


def run_node(make_node: Callable[[], Any], argv: list[str],
             mistakes: tuple[type[Exception], ...],
             spin: Callable[[Any, StopFlag], None] | None = None) -> int:
    """
    Spin a node until it is interrupted; return the exit code of the process.

    make_node: called without arguments; returns a node, or a list of some that spin together.
        The `mistake` of a node, if set, ends it, and so does `has_ended`, if it is true; its
        `leave()` is called at the end.
    argv: the command line.
    mistakes: exception types whose message is for the user: printed on one line, exit code 2,
        or that of its attribute `exit_code`.
    spin: called with the node and the `StopFlag` instead of spinning it in the ordinary way.

    """
    if {'-h', '--help'} & set(_before_ros_arguments(argv)):
        print(help_text(Path(argv[0]).name))
        return 0
    try:
        with interrupts() as stop:
            if _is_released(stop):
                _init(argv)
                (spin or _spin)(make_node(), stop)
    except (RosStartError, *mistakes) as mistake:
        print(f'{Path(argv[0]).name}: {mistake}', file=sys.stderr)
        return getattr(mistake, 'exit_code', 2)
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):  # a second one finds nothing to interrupt
            signal.signal(number, signal.SIG_IGN)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(SHUTDOWN_TIMEOUT)  # seen once: Fast DDS looped here and would not end
        destroy_nodes()
        gc.collect()  # of a node that could not be made, parts are left
        rclpy.try_shutdown()
        signal.alarm(0)
    return 0


def _is_released(stop: StopFlag) -> bool:
    """Wait while this process is held; return False if it must end, as its parent has."""
    if HOLD not in os.environ:
        return True
    while not stop.is_set():
        if select([sys.stdin], [], [], POLL_PERIOD)[0]:
            return bool(os.read(sys.stdin.fileno(), 1))
    return False


def _init(argv: list[str]) -> None:
    """Start rclpy; raises RosStartError."""
    not_ros = _before_ros_arguments(argv)
    if not_ros:
        raise RosStartError(f'takes ROS arguments only, got {" ".join(not_ros)!r}; '
                            'parameters are given as --ros-args -p NAME:=VALUE')
    start_rclpy(argv)


def _before_ros_arguments(argv: list[str]) -> list[str]:
    return list(takewhile(lambda word: word != '--ros-args', argv[1:]))


def _spin(made: Any, stop: StopFlag) -> None:
    nodes, executor = made if isinstance(made, list) else [made], EventsExecutor()
    for node in nodes:
        executor.add_node(node)
    gc.freeze()  # what a node is made of is not looked through while it runs
    gc.set_threshold(GARBAGE_THRESHOLD)
    for node in nodes:
        node.get_logger().info('ready')
    has_ended = False
    try:
        while rclpy.ok() and not stop.is_set() and not has_ended:
            executor.spin_once(timeout_sec=POLL_PERIOD)  # spin() of the wheels loops when idle
            has_ended = any(node.has_ended for node in nodes)
            for node in [each for each in nodes if each.mistake]:
                if len(nodes) == 1:
                    raise node.mistake
                node.get_logger().error(f'{node.mistake}; this node ends, and the others of its '
                                        'process go on')
                nodes.remove(node)
                executor.remove_node(node)
                node.leave()
                node.destroy_node()
    finally:
        for node in nodes:
            node.leave()
        executor.shutdown()  # before its node is destroyed
