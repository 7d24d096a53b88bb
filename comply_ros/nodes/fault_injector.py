# SPDX-License-Identifier: Apache-2.0
"""The node that stands between others and drops, delays, duplicates and reorders messages."""

from importlib import import_module
import time

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from comply_ros.nodes.parameters import (
    declare,
    FAULTS,
    KEPT,
    ParameterError,
    SafeParameterNode,
    SEED,
    TOPICS,
    unknown_overrides,
)
from comply_ros.nodes.protocol_node import PATIENCE
from comply_ros.nodes.spin import run_node
from comply_ros.protocol.channel_faults import fault_streams, FaultError, Faults, FaultyChannel

LOOK = 0.1  # seconds between looks for who speaks on the topics
TICK = 0.002  # seconds between looks at messages that are late, while there are any
DEPTH = 100  # messages that may wait for the relay, or for who hears it


class TopicError(ValueError):
    """A topic that cannot be relayed; the message names it, the rule and the types."""


class FaultInjectorNode(SafeParameterNode):
    """
    Says on each topic T what it hears on T/before, with faults; of any message type.

    Attributes
    ----------
    wires: what is late on each topic, and the counts, by topic.
    mistake: None; an exception here would end the node.

    """

    def __init__(self, **kwargs):
        super().__init__('fault_injector', **kwargs)
        names, seed, self._kept = (declare(self, each) for each in (TOPICS, SEED, KEPT))
        faults = declare_faults(self)
        check_topics(self, names)
        self.mistake = None
        self.wires = dict(zip(names, (FaultyChannel(faults, each)
                                      for each in fault_streams(seed, len(names)))))
        self._publish = {}  # functions, of the topics that are relayed
        self._told = set()  # topics that were warned of
        self._born, self._has_waited = time.monotonic(), False
        self.create_timer(LOOK, self._look)
        self._ticks = self.create_timer(TICK, self._say_due)
        self._ticks.cancel()
        for unknown in unknown_overrides(self):
            self.get_logger().warning(f'parameter {unknown!r} is unknown and has no effect')

    def _look(self):
        """Relay each topic that somebody speaks on; warn, once, of what cannot be right."""
        for name in self.wires:
            ends = self.get_publishers_info_by_topic(self.resolve_topic_name(before(name)))
            if ends:
                self._match(name, ends)
        if not self._has_waited and time.monotonic() - self._born > PATIENCE:
            self._has_waited = True
            self._tell_waiting(set(self.wires) - set(self._publish) - self._told)

    def _tell_waiting(self, silent):
        if silent:
            self.get_logger().warning('waits for a node that speaks on ' + ', '.join(
                f'{before(name)} (started with -r {name}:={before(name)})'
                for name in sorted(silent)))

    def _match(self, name, ends):
        """Begin to relay a topic if its publishers agree; warn, once, if they do not."""
        try:
            kind = message_type(before(name), {end.topic_type for end in ends})
        except TopicError as error:
            if name not in self._told:
                so = 'the type that came first' if name in self._publish else 'none'
                self.get_logger().warning(f'{error}; {so} is relayed')
            self._told.add(name)
            return
        if name not in self._publish:
            self._relay(name, kind, offered(ends, self._kept))
            self.get_logger().info(f'relays {name} ({ends[0].topic_type})')

    def _relay(self, name, kind, qos):
        """Make the two ends of a topic, with the QoS to hear and to say it."""
        self._publish[name] = self.create_publisher(kind, name, qos[1]).publish
        self.create_subscription(
            kind, before(name), lambda message: self._hear(name, message), qos[0], raw=True)

    def _hear(self, name, message):
        self.wires[name].put(message, time.monotonic())
        self._say_due()

    def _say_due(self):
        """Publish what is due on each topic; the timer ticks while there is more to come."""
        for name, wire in self.wires.items():
            for message in wire.due(time.monotonic()):
                self._publish[name](message)
        is_empty = all(wire.is_empty() for wire in self.wires.values())
        if is_empty != self._ticks.is_canceled():
            (self._ticks.cancel if is_empty else self._ticks.reset)()

    def leave(self):
        """Log what happened on each topic: the node ends."""
        for name, wire in self.wires.items():
            self.get_logger().info(f'{name}: ' + ', '.join(
                f'{count} {what}' for what, count in wire.counts.items()))


def before(name):
    """Name of the topic that is heard, for one that is said."""
    return f'{name}/before'


def declare_faults(node):
    """Declare the parameters of `Faults` and return it; raises ParameterError."""
    values = {each.name: declare(node, each) for each in FAULTS}
    try:
        return Faults(**values)
    except FaultError as error:
        raise ParameterError(f'parameter {error}') from None


def check_topics(node, names):
    """
    Return if the topics can be relayed.

    Raises
    ------
    ParameterError: without topics, for one that is named twice, that ROS cannot have, or that a
        remapping leads back to itself.

    """
    if not names:
        raise ParameterError('parameter topics must name a topic, got none')
    known = {}
    for name in names:
        full = resolved(node, name)
        if full in known:
            raise ParameterError(f'parameter topics must name each topic once, got '
                                 f'{known[full]!r} and {name!r}')
        if full == resolved(node, before(name)):
            raise ParameterError(f'parameter topics: {name} and {before(name)} must be two '
                                 f'topics, got {full} for both')
        known[full] = name


def resolved(node, name):
    """Return the full name of a topic; raises ParameterError where ROS cannot have it."""
    try:
        return node.resolve_topic_name(name)
    except RuntimeError as error:
        reason = str(error).removeprefix('failed to resolve name: ').partition(', at /')[0]
        raise ParameterError(f'parameter topics: {reason}, got {name!r}') from None


def message_type(name, kinds):
    """
    Return the class of a topic's messages, given the types that its publishers have.

    Raises
    ------
    TopicError: if they do not agree, or their package is not here.

    """
    if len(kinds) > 1:
        raise TopicError(f'{name} must have messages of one type, got '
                         f'{" and ".join(sorted(kinds))}')
    package, _, message = min(kinds).split('/')
    try:
        return getattr(import_module(f'{package}.msg'), message)
    except (ImportError, AttributeError):
        raise TopicError(f'{name} must have messages of a package that is installed, got '
                         f'{min(kinds)}') from None


def offered(ends, kept):
    """Pair of QoS to hear a topic and to say it on, as all of its publishers offer it."""
    offers = [end.qos_profile for end in ends]
    is_reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offers)
    is_latched = all(qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in offers)
    same = {'reliability': (ReliabilityPolicy.RELIABLE if is_reliable
                            else ReliabilityPolicy.BEST_EFFORT),
            'durability': (DurabilityPolicy.TRANSIENT_LOCAL if is_latched
                           else DurabilityPolicy.VOLATILE)}
    return (QoSProfile(depth=max(kept, DEPTH), **same),
            QoSProfile(depth=kept if is_latched else DEPTH, **same))


def main(argv):
    """Run the node; return the exit code."""
    made = []  # it lives to the end, when it logs its summary
    return run_node(lambda: made.append(FaultInjectorNode()) or made[0], argv, (ParameterError,))
