# SPDX-License-Identifier: Apache-2.0
"""A node between other nodes that drops, delays, duplicates and reorders their messages."""

from collections.abc import Callable, Sequence
from fnmatch import fnmatchcase
from importlib import import_module
import time
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from comply_ros.nodes.clocks import steady_timer
from comply_ros.nodes.parameter_node import SafeParameterNode
from comply_ros.nodes.parameters import DEPTH, FAULTS, ParameterError, SEED, TOPICS
from comply_ros.nodes.protocol_node import PATIENCE
from comply_ros.nodes.spin import run_node
from comply_ros.protocol.channel_faults import (
    fault_streams,
    FaultError,
    Faults,
    FaultyChannel,
    stream_of_topic,
)
from comply_ros.storage.file_system import printable

DISCOVERY_PERIOD = 0.1  # seconds between two checks for publishers
DUE_PERIOD = 0.002  # seconds between two checks for delayed messages, while there are any
ANY, STAND_IN = '*', 'any_part'  # of the name of a topic, and what is allowed in its place
QUEUE = 100  # messages that may wait for the relay, or for its subscribers


class TopicError(ValueError):
    """A topic that cannot be relayed; the message names it, the rule and the types."""


class FaultInjectorNode(SafeParameterNode):
    """Publishes on each topic T what it receives on T/before, with faults; of any type."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('fault_injector', **kwargs)
        self.mistake = None  # an exception here would end the node
        names, self._seed, self._depth = (self.declare(each) for each in (TOPICS, SEED, DEPTH))
        try:
            self._faults = Faults(**{each.name: self.declare(each) for each in FAULTS})
        except FaultError as error:
            raise ParameterError(f'parameter {error}') from None
        check_topics(self, names)
        self._channels = {name: FaultyChannel(self._faults, generator) for name, generator in
                          zip(names, fault_streams(self._seed, len(names))) if ANY not in name}
        self._patterns = [resolved(self, before(name)) for name in names if ANY in name]
        self._publish: dict[str, Callable[[bytes], None]] = {}  # of topics that are relayed
        self._warned: set[str] = set()  # topics
        self._start, self._has_waited = time.monotonic(), False
        steady_timer(self, DISCOVERY_PERIOD, self._discover)
        self._due_timer = steady_timer(self, DUE_PERIOD, self._publish_due)
        self._due_timer.cancel()

    def leave(self) -> None:
        """Log what happened on each topic: the node ends."""
        for name, channel in self._channels.items():
            self.get_logger().info(f'{name}: ' + ', '.join(
                f'{count} {what}' for what, count in channel.counts.items()))

    def _discover(self) -> None:
        """Relay each topic that has a publisher; warn, once, of what cannot be relayed."""
        for name in self._new_names() if self._patterns else ():
            self._channels[name] = FaultyChannel(self._faults, stream_of_topic(self._seed, name))
        for name in self._channels:
            ends = self.get_publishers_info_by_topic(self.resolve_topic_name(before(name)))
            if ends:
                self._match(name, ends)
        if self._has_waited or time.monotonic() - self._start <= PATIENCE:
            return
        self._has_waited = True
        silent = sorted(set(self._channels) - set(self._publish) - self._warned)
        if silent:
            self.get_logger().warning('waits for a publisher on ' + ', '.join(
                f'{before(name)} (a node started with -r {name}:={before(name)})'
                for name in silent))

    def _new_names(self) -> list[str]:
        """Return the names of topics that have a pattern, and are not relayed yet."""
        found = [topic for topic, _ in self.get_topic_names_and_types()
                 if any(fnmatchcase(topic, pattern) and topic.count('/') == pattern.count('/')
                        for pattern in self._patterns)]
        names = [topic.removesuffix(before('')) for topic in found]
        return [name for name in names if name not in self._channels]

    def _match(self, name: str, ends: Sequence[TopicEndpointInfo]) -> None:
        """Start to relay a topic if its publishers agree; warn, once, if they do not."""
        try:
            message = message_type(before(name), {end.topic_type for end in ends})
        except TopicError as error:
            if name not in self._warned:
                which = 'the type that came first' if name in self._publish else 'none'
                self.get_logger().warning(f'{error}; {which} is relayed')
            self._warned.add(name)
            return
        if name in self._publish:
            return
        receiving, sending = offered_qos(ends, self._depth)
        self._publish[name] = self.create_publisher(message, name, sending).publish
        self.create_subscription(message, before(name), lambda content: self._receive(
            name, content), receiving, raw=True)
        self.get_logger().info(f'relays {name} ({ends[0].topic_type})')

    def _receive(self, name: str, content: bytes) -> None:
        self._channels[name].put(content, time.monotonic())
        self._publish_due()

    def _publish_due(self) -> None:
        """Publish what is due on each topic; the timer runs while there is more to come."""
        for name, channel in self._channels.items():
            for content in channel.due(time.monotonic()):
                self._publish[name](content)
        is_empty = all(channel.is_empty() for channel in self._channels.values())
        if is_empty != self._due_timer.is_canceled():
            (self._due_timer.cancel if is_empty else self._due_timer.reset)()


def before(name: str) -> str:
    """Name of the topic that is received, for one that is published."""
    return f'{name}/before'


def resolved(node: Node, name: str) -> str:
    """Return the full name of a topic, of which a part may be any; raises RuntimeError."""
    return node.resolve_topic_name(name.replace(ANY, STAND_IN)).replace(STAND_IN, ANY)


def check_topics(node: Node, names: Sequence[str]) -> None:
    """
    Return if the topics can be relayed.

    Raises ParameterError without topics, for one that is named twice, that ROS cannot have, or
    that a remapping leads back to itself.
    """
    if not names:
        raise ParameterError('parameter topics must name a topic, got none')
    known: dict[str, str] = {}
    for name in names:
        try:
            full, full_before = (resolved(node, each) for each in (name, before(name)))
        except RuntimeError as error:
            reason = str(error).removeprefix('failed to resolve name: ').partition(', at /')[0]
            raise ParameterError(
                f'parameter topics: {printable(reason)}, got {name!r}') from None
        if full in known:
            raise ParameterError(f'parameter topics must name each topic once, got '
                                 f'{known[full]!r} and {name!r}')
        if full == full_before:
            raise ParameterError(f'parameter topics: {name} and {before(name)} must be two '
                                 f'topics, got {full} for both')
        known[full] = name


def message_type(name: str, types: set[str]) -> type:
    """
    Return the class of a topic's messages, given the types that its publishers have.

    Raises TopicError if they do not agree, or their package is not installed.
    """
    if len(types) > 1:
        raise TopicError(f'{name} must have messages of one type, got '
                         f'{" and ".join(sorted(types))}')
    package, _, message = min(types).split('/')
    try:
        return getattr(import_module(f'{package}.msg'), message)
    except (ImportError, AttributeError):
        raise TopicError(f'{name} must have messages of a package that is installed, got '
                         f'{min(types)}') from None


def offered_qos(ends: Sequence[TopicEndpointInfo], depth: int) -> tuple[QoSProfile, QoSProfile]:
    """Return the QoS to receive and to publish a topic with, as all its publishers offer it."""
    offers = [end.qos_profile for end in ends]
    is_latched = all(qos.durability == DurabilityPolicy.TRANSIENT_LOCAL for qos in offers)
    is_reliable = all(qos.reliability == ReliabilityPolicy.RELIABLE for qos in offers)
    reliability = ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT
    durability = DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE
    receiving, sending = (
        QoSProfile(depth=each, reliability=reliability, durability=durability)
        for each in (max(depth, QUEUE), depth if is_latched else QUEUE))
    return receiving, sending


def main(argv: list[str]) -> int:
    """Run the node; return the exit code."""
    made = []  # it lives to the end, when it logs its summary
    return run_node(lambda: made.append(FaultInjectorNode()) or made[0], argv, (ParameterError,))
