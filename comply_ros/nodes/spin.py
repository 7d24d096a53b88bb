# SPDX-License-Identifier: Apache-2.0
"""How a node starts, spins and ends, whatever it is told meanwhile."""

from itertools import takewhile
from pathlib import Path
import signal
import sys

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.logging import get_logger_level, LoggingSeverity, set_logger_level
from rclpy.signals import SignalHandlerOptions

from comply_ros.terminal.interrupts import interrupts

LAST = 5  # seconds that rclpy has to shut down; then the kernel ends the process
LOOK = 0.1  # seconds between looks at whether there was a Ctrl-C


class CommandLineError(ValueError):
    """ROS arguments that rclpy cannot read."""


def run_node(make_node, argv, mistakes, spin=None):
    """
    Spin a node until it is interrupted; return the exit code of the process.

    make_node: called without arguments; its `mistake` ends it, and it may `leave` at the end.
    argv: the command line.
    mistakes: exception types whose message is for the user: printed on one line, exit code 2.
    spin: called with the node and the `Stop` instead of spinning it in the ordinary way.

    """
    try:
        with interrupts() as stop:
            _init(argv)
            (spin or _spin)(make_node(), stop)
    except (CommandLineError, *mistakes) as mistake:
        print(f'{Path(argv[0]).name}: {mistake}', file=sys.stderr)
        return 2
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):  # a second one finds nothing to interrupt
            signal.signal(number, signal.SIG_IGN)
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(LAST)  # seen once: Fast DDS turned in circles here and would not end
        rclpy.try_shutdown()
        signal.alarm(0)
    return 0


def _init(argv):
    """Start rclpy without signal handlers of its own: they break into callbacks."""
    strangers = list(takewhile(lambda word: word != '--ros-args', argv[1:]))
    if strangers:
        raise CommandLineError(f'takes ROS arguments only, got {" ".join(strangers)!r}; '
                               'parameters are given as --ros-args -p NAME:=VALUE')
    set_logger_level('rcl', LoggingSeverity.FATAL)  # it says the same in a line before ours
    try:
        rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    except (RuntimeError, UnicodeError) as error:
        reason = str(error).removeprefix('failed to initialize rcl: ').partition(', at /')[0]
        raise CommandLineError('the arguments after --ros-args must be known and valid: '
                               f'{" ".join(reason.split())}') from None
    if get_logger_level('rcl') == LoggingSeverity.FATAL:  # and not what --log-level rcl:= says
        set_logger_level('rcl', LoggingSeverity.UNSET)


def _spin(node, stop):
    executor = EventsExecutor()
    executor.add_node(node)
    node.get_logger().info('ready')
    try:
        while rclpy.ok() and not stop.is_set():
            executor.spin_once(timeout_sec=LOOK)  # spin() of the wheels turns in circles when idle
            if node.mistake:
                raise node.mistake
    finally:
        node.leave()
