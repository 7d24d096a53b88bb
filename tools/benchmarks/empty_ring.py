# SPDX-License-Identifier: Apache-2.0
"""A process of the empty ring: three of them pass messages on and compute nothing."""

from collections.abc import Callable, Sequence
from pathlib import Path
import sys
from typing import Any

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions

from comply_ros.nodes.topics import ACTION, RECOMMENDATION, STATE
from comply_ros.terminal.interrupts import end_with_parent, interrupts, StopFlag
from tools.benchmarks.step_times import StepTimes

SUBSCRIBES_AND_PUBLISHES = {'world': (ACTION, STATE), 'mentor': (STATE, RECOMMENDATION),
                            'learner': (RECOMMENDATION, ACTION)}
SPIN_TIMEOUT = 0.1  # seconds between checks for Ctrl-C


def forward(publisher: Publisher, message: Any) -> Callable[[Any], None]:
    """Return a callback that publishes the message with the run and step id that it received."""
    publish = publisher.publish

    def on_message(msg: Any) -> None:
        message.run, message.episode, message.step = msg.run, msg.episode, msg.step
        publish(message)
    return on_message


def count_up(publisher: Publisher, message: Any,
             record: Callable[[], None]) -> Callable[[Any], None]:
    """Return the callback of the world: it records the time and publishes the next step id."""
    publish = publisher.publish

    def on_message(msg: Any) -> None:
        record()
        message.run, message.episode, message.step = msg.run, msg.episode, msg.step + 1
        publish(message)
    return on_message


def spin(role: str, times: StepTimes, stop: StopFlag) -> None:
    """Pass messages on until the process is interrupted."""
    source, target = SUBSCRIBES_AND_PUBLISHES[role]
    node = rclpy.create_node(role)
    publisher = node.create_publisher(target.message, target.name, target.qos)
    message = target.message()
    callback = (count_up(publisher, message, times.record) if role == 'world'
                else forward(publisher, message))
    node.create_subscription(source.message, source.name, callback, source.qos)
    if role == 'world':
        publisher.publish(message)
    executor = EventsExecutor()
    executor.add_node(node)
    while not stop.is_set():
        executor.spin_once(timeout_sec=SPIN_TIMEOUT)


def main(argv: Sequence[str]) -> int:
    """Run one process; return the exit code. argv: name, parent, folder, role, ROS arguments."""
    _, parent, folder, role, *arguments = argv
    end_with_parent(int(parent))
    times = StepTimes(Path(folder))
    with interrupts() as stop:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        spin(role, times, stop)
        rclpy.try_shutdown()
    if role == 'world':
        times.write()
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv))
