# SPDX-License-Identifier: Apache-2.0
"""What the three nodes share: to listen, to say, to warn once, to start and to end."""

from collections import Counter
from itertools import takewhile
from pathlib import Path
import signal
import sys

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from comply_ros.core.dialogue import Notice, Refused
from comply_ros.nodes.parameters import declare, unknown_overrides
from comply_ros.nodes.topics import decoder, encoder
from comply_ros.session.interrupts import interrupts

LOOK = 0.1  # seconds between looks at whether there was a Ctrl-C
PATIENCE = 3  # seconds of waiting after which a node says for what


class CommandLineError(ValueError):
    """ROS arguments that rclpy cannot read."""


class ActorNode(Node):
    """
    A node that says what its actor returns.

    Attributes
    ----------
    actor: the state machine of core that this node is a shell of.
    refused: counts of refused messages by kind.
    mistake: an exception that a callback found; it ends the node.

    """

    def __init__(self, name, **kwargs):
        super().__init__(name, **kwargs)
        self.actor, self.refused, self.mistake = None, Counter(), None
        self._waited = None, 0
        self.create_timer(1.0, self._tell_waiting)
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

    def _tell_waiting(self):
        """Warn, once, of what the actor has been waiting for."""
        what, seconds = self._waited
        now = self.actor.waits_for()
        self._waited = now, seconds + 1 if now == what else 0
        if now and self._waited[1] == PATIENCE:
            self.get_logger().warning(f'waits for {now}')

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
    try:
        with interrupts() as stop:
            _init(argv)
            _spin(make_node(), stop)
    except (CommandLineError, *mistakes) as mistake:
        print(f'{Path(argv[0]).name}: {mistake}', file=sys.stderr)
        return 2
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):  # a second one finds nothing to interrupt
            signal.signal(number, signal.SIG_IGN)
        rclpy.try_shutdown()
    return 0


def _init(argv):
    """Start rclpy without signal handlers of its own: they break into callbacks."""
    strangers = list(takewhile(lambda word: word != '--ros-args', argv[1:]))
    if strangers:
        raise CommandLineError(f'takes ROS arguments only, got {" ".join(strangers)!r}; '
                               'parameters are given as --ros-args -p NAME:=VALUE')
    try:
        rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        reason = str(error).removeprefix('failed to initialize rcl: ').partition(', at /')[0]
        raise CommandLineError(
            f'the arguments after --ros-args must be known and valid: {reason}') from None


def _spin(node, stop):
    executor = EventsExecutor()
    executor.add_node(node)
    node.get_logger().info('ready')
    while rclpy.ok() and not stop.is_set():
        executor.spin_once(timeout_sec=LOOK)  # spin() of the wheels turns in circles when idle
        if node.mistake:
            raise node.mistake
