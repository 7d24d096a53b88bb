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
from rclpy.logging import get_logger_level, LoggingSeverity, set_logger_level
from rclpy.signals import SignalHandlerOptions

from comply_ros.storage.file_system import printable
from comply_ros.terminal.interrupts import interrupts, StopFlag

HOLD = 'COMPLY_ROS_HOLD'  # environment variable: start when a byte comes on standard input
POLL_PERIOD = 0.1  # seconds between two checks for Ctrl-C
SHUTDOWN_TIMEOUT = 5  # seconds that rclpy has to shut down; then the kernel ends the process


class CommandLineError(ValueError):
    """ROS arguments that rclpy cannot read."""


def run_node(make_node: Callable[[], Any], argv: list[str],
             mistakes: tuple[type[Exception], ...],
             spin: Callable[[Any, StopFlag], None] | None = None) -> int:
    """
    Spin a node until it is interrupted; return the exit code of the process.

    make_node: called without arguments; the node's `mistake`, if set, ends it, and so does
        `has_ended`, if it has one and it is true; its `leave()` is called at the end.
    argv: the command line.
    mistakes: exception types whose message is for the user: printed on one line, exit code 2.
    spin: called with the node and the `StopFlag` instead of spinning it in the ordinary way.

    """
    try:
        with interrupts() as stop:
            if _is_released(stop):
                _init(argv)
                (spin or _spin)(make_node(), stop)
    except (CommandLineError, *mistakes) as mistake:
        print(f'{Path(argv[0]).name}: {mistake}', file=sys.stderr)
        return 2
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):  # a second one finds nothing to interrupt
            signal.signal(number, signal.SIG_IGN)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(SHUTDOWN_TIMEOUT)  # seen once: Fast DDS looped here and would not end
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
    """Start rclpy without signal handlers of its own: they break into callbacks."""
    not_ros = list(takewhile(lambda word: word != '--ros-args', argv[1:]))
    if not_ros:
        raise CommandLineError(f'takes ROS arguments only, got {" ".join(not_ros)!r}; '
                               'parameters are given as --ros-args -p NAME:=VALUE')
    set_logger_level('rcl', LoggingSeverity.FATAL)  # it logs the same in a line before ours
    try:
        rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    except (RuntimeError, UnicodeError) as error:
        reason = str(error).removeprefix('failed to initialize rcl: ').partition(', at /')[0]
        raise CommandLineError('the arguments after --ros-args must be known and valid: '
                               f'{printable(" ".join(reason.split()))}') from None
    if get_logger_level('rcl') == LoggingSeverity.FATAL:  # and not what --log-level rcl:= says
        set_logger_level('rcl', LoggingSeverity.UNSET)


def _spin(node: Any, stop: StopFlag) -> None:
    executor = EventsExecutor()
    executor.add_node(node)
    gc.freeze()  # what a node is made of is not looked through while it runs
    node.get_logger().info('ready')
    try:
        while rclpy.ok() and not stop.is_set() and not getattr(node, 'has_ended', False):
            executor.spin_once(timeout_sec=POLL_PERIOD)  # spin() of the wheels loops when idle
            if node.mistake:
                raise node.mistake
    finally:
        node.leave()
