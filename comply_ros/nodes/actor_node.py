# SPDX-License-Identifier: Apache-2.0
"""What the three nodes share: to listen, to say, to warn once, to start and to end."""

from collections import Counter
from pathlib import Path
import signal
import sys

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from comply_ros.core.dialogue import Notice, Refused
from comply_ros.nodes.parameters import declare, unknown_overrides
from comply_ros.nodes.topics import decoder, encoder


class CommandLineError(ValueError):
    """ROS arguments that rclpy cannot read."""


class ActorNode(Node):
    """
    A node that says what its actor returns.

    Attributes
    ----------
    refused: counts of refused messages by kind.

    """

    def __init__(self, name, **kwargs):
        super().__init__(name, **kwargs)
        self.refused = Counter()
        self._voices = {Refused: self._warn, Notice: self._tell}
        for unknown in unknown_overrides(self):
            self.get_logger().warning(f'parameter {unknown!r} is unknown and has no effect')

    def declare(self, parameter):
        """Declare a parameter and return its value; raises ParameterError."""
        return declare(self, parameter)

    def speaks_on(self, topic):
        """Make a publisher: tuples of the topic's kind that are said go there."""
        publish, encode = self.create_publisher(topic.message, topic.name, topic.qos).publish, \
            encoder(topic)
        self._voices[topic.said] = lambda said: publish(encode(said))

    def listens_to(self, topic, hear):
        """Subscribe: every message on the topic is decoded, heard, and the reply is said."""
        decode = decoder(topic)
        self.create_subscription(
            topic.message, topic.name, lambda message: self.say(hear(decode(message))), topic.qos)

    def say(self, utterances):
        """Publish, or log, each of the tuples."""
        for said in utterances:
            self._voices[type(said)](said)

    def _warn(self, said):
        self.refused[said.kind] += 1
        if self.refused[said.kind] == 1:
            self.get_logger().warning(f'refused: {said.reason} (told once, counted)')

    def _tell(self, said):
        self.get_logger().info(said.text)


def run_node(make_node, argv, mistakes):
    """
    Spin a node until it is interrupted; return the exit code of the process.

    make_node: called without arguments.
    argv: the command line.
    mistakes: exception types whose message is for the user: printed on one line, exit code 2.

    """
    interrupts = []  # no exception in the middle of a callback: the loop looks here
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: interrupts.append(_))
    try:
        _init(argv)
        _spin(make_node(), interrupts)
    except (CommandLineError, *mistakes) as mistake:
        print(f'{Path(argv[0]).name}: {mistake}', file=sys.stderr)
        return 2
    except Exception:  # noqa: BLE001
        if rclpy.ok():  # otherwise the interrupt came in the middle of a call
            raise
    finally:
        rclpy.try_shutdown()
    return 0


def _init(argv):
    try:
        rclpy.init(args=argv)
    except RuntimeError as error:
        reason = str(error).removeprefix('failed to initialize rcl: ').partition(', at /')[0]
        raise CommandLineError(f'the arguments after --ros-args must be valid: {reason}') from None


def _spin(node, interrupts):
    executor = EventsExecutor()
    executor.add_node(node)
    node.get_logger().info('ready')
    while rclpy.ok() and not interrupts:
        executor.spin_once(timeout_sec=1.0)  # spin() of the wheels turns in circles when idle
