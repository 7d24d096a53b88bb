# SPDX-License-Identifier: Apache-2.0
"""A process of the empty ring: three of them pass messages on and compute nothing."""

from collections.abc import Callable, Sequence
from pathlib import Path
import sys
import time
from typing import Any

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.signals import SignalHandlerOptions

from comply_ros.nodes.topics import ACTION, decoder, reader, RECOMMENDATION, STATE, writer
from comply_ros.terminal.interrupts import end_with_parent, interrupts, StopFlag
from tools.benchmarks.step_times import StepTimes

SUBSCRIBES_AND_PUBLISHES = {'world': (ACTION, STATE), 'mentor': (STATE, RECOMMENDATION),
                            'learner': (RECOMMENDATION, ACTION)}
SPIN_TIMEOUT = 0.1  # seconds between checks for Ctrl-C


Values = Any  # one of the tuples of `protocol.messages`


def forward(publish: Callable[[Values], None], values: Values) -> Callable[[Values], None]:
    """Return what publishes the values with the run and step id that it is called with."""
    return lambda msg: publish(values._replace(run=msg.run, episode=msg.episode, step=msg.step))


def count_up(publish: Callable[[Values], None], values: Values,
             record: Callable[[], None]) -> Callable[[Values], None]:
    """Return what the world does: record the time, and publish the next step id."""
    def on_message(msg: Values) -> None:
        record()
        publish(values._replace(run=msg.run, episode=msg.episode, step=msg.step + 1))
    return on_message


def spin(role: str, times: StepTimes, stop: StopFlag) -> None:
    """Pass messages on until the process is interrupted."""
    source, target = SUBSCRIBES_AND_PUBLISHES[role]
    node = rclpy.create_node(role)
    publisher = node.create_publisher(target.message, target.name, target.qos)
    read = reader(source)
    write = writer(target, time.time_ns)  # as the nodes do: rclpy would take several times as long

    def publish(values: Values) -> None:
        publisher.publish(write(values))
    values = decoder(target)(target.message())
    handle = (count_up(publish, values, times.record) if role == 'world'
              else forward(publish, values))
    node.create_subscription(source.message, source.name,
                             lambda content: handle(read(content)), source.qos, raw=True)
    if role == 'world':
        publish(values)
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
