# SPDX-License-Identifier: Apache-2.0
"""One of three processes that only pass messages on: the least that a loop over topics costs."""

from pathlib import Path
import sys

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.signals import SignalHandlerOptions

from comply_ros.nodes.spin import POLL_PERIOD
from comply_ros.nodes.topics import ACTION, RECOMMENDATION, STATE
from comply_ros.terminal.interrupts import end_with_parent, interrupts
from tools.benchmarks.step_times import Stamps

HEARS_AND_SAYS = {'world': (ACTION, STATE), 'mentor': (STATE, RECOMMENDATION),
                  'learner': (RECOMMENDATION, ACTION)}


def passes_on(publisher, message, note):
    """Return a callback that publishes the message, with run and turn of what it hears."""
    publish = publisher.publish

    def pass_on(msg):
        note()
        message.run, message.episode, message.step = msg.run, msg.episode, msg.step
        publish(message)
    return pass_on


def leads_on(publisher, message, note):
    """Return a callback of the first in the ring, which counts the turns."""
    publish = publisher.publish

    def lead_on(msg):
        note()
        message.run, message.episode, message.step = msg.run, msg.episode, msg.step + 1
        publish(message)
    return lead_on


def spin(role, note, stop):
    """Pass on until it is interrupted."""
    hears, says = HEARS_AND_SAYS[role]
    node = rclpy.create_node(role)
    publisher, message = node.create_publisher(says.message, says.name, says.qos), says.message()
    make = leads_on if role == 'world' else passes_on
    node.create_subscription(hears.message, hears.name, make(publisher, message, note), hears.qos)
    if role == 'world':
        publisher.publish(message)
    executor = EventsExecutor()
    executor.add_node(node)
    while not stop.is_set():
        executor.spin_once(timeout_sec=POLL_PERIOD)


def main(argv):
    """Run one of the three; return the exit code. argv: name, parent, folder, role, ROS."""
    _, parent, folder, role, *arguments = argv
    end_with_parent(int(parent))
    stamps = Stamps(Path(folder))
    note = stamps.note if role == 'world' else lambda: None
    with interrupts() as stop:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        spin(role, note, stop)
        rclpy.try_shutdown()
    if role == 'world':
        stamps.write()
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv))
