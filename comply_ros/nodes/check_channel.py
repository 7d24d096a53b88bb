# SPDX-License-Identifier: Apache-2.0
"""The channel of a check to a live node, and what the graph shows of the node."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable
from pathlib import Path
import secrets
import tempfile
import time
from typing import Any

from comply_msgs.srv import Save
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import Trigger

from comply_ros.nodes.external_node import FIND_TIME, PARTS
from comply_ros.nodes.started_node import StartedNode
from comply_ros.nodes.topics import (
    ACTION,
    decoder,
    DESCRIPTION,
    encoder,
    EPISODE,
    MENTOR_POLICY,
    node_name,
    publisher_names,
    RECOMMENDATION,
    SAVE,
    STATE,
    Topic,
    WORLD,
)
from comply_ros.protocol.rule_report import PATIENCE, QUIET, Received
from comply_ros.terminal.interrupts import check, StopFlag

LEASE = 21.0  # seconds in which Fast DDS finds out that a process was killed, and some more
LOOK_PERIOD = 1.0  # seconds between two looks at the graph
SERVICE_TIME = 1.0  # seconds in which a service must be found, and the last messages come
# Of each kind of node: what it publishes, and what the check publishes.
RECEIVED: dict[str, tuple[Topic, ...]] = {
    'world': (STATE, WORLD, EPISODE), 'mentor': (RECOMMENDATION, MENTOR_POLICY),
    'learner': (ACTION, DESCRIPTION)}
SENT: dict[str, tuple[Topic, ...]] = {
    'world': (ACTION, WORLD), 'mentor': (WORLD, STATE, ACTION),
    'learner': (WORLD, STATE, RECOMMENDATION)}


class NoNodeError(RuntimeError):
    """There is not one node to check; the message names those that there are."""


class RosChannel:
    """
    The `Channel` to one node, over the topics of this namespace.

    Parameters
    ----------
    node: that of the check.
    kind: of the node that is checked: `world`, `mentor` or `learner`.
    stop: whether the user wants to stop; then KeyboardInterrupt is raised.
    started: starts that node, None if it runs already.
    seed: with which it is started first.

    Attributes
    ----------
    name: full name of the node that is checked, once it is found.
    statuses: names in `/diagnostics` so far.
    delays: seconds from the stamp of each message with a header until it came.
    counts: messages of each topic since the node was started.
    late: of each topic, how many messages a late subscriber received, and should have.

    """

    def __init__(self, node: Node, kind: str, stop: StopFlag,
                 started: StartedNode | None = None, seed: int = 0) -> None:
        self._node, self._kind, self._started, self._seed = node, kind, started, seed
        self._stop = stop
        self.name, self.statuses, self.delays = '', set[str](), list[float]()
        self.counts: Counter[str] = Counter()
        self.late: list[tuple[str, int, int]] = []
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)
        self.received: defaultdict[str, list[Received]] = defaultdict(list)
        self.transcript: list[Received] = []
        self._next_look = 0.0
        self.last_run, self.followed = 1 + secrets.randbelow(2 ** 31), 0
        self.sent_worlds: set[int] = set()
        self._publishers: dict[str, tuple[Any, Callable[[Any], Any]]] = {}
        self._advertise()
        node.create_subscription(DiagnosticArray, '/diagnostics', lambda msg: self.statuses.update(
            status.name for status in msg.status), 10)

    @property
    def namespace(self) -> str:
        """The namespace of the topics."""
        return self._node.get_namespace()

    @property
    def time(self) -> float:
        """Seconds of a steady clock."""
        return time.monotonic()

    def send(self, message: Any) -> None:
        """Publish a message."""
        publisher, fill = self._publishers[type(message).__name__]
        if hasattr(message, 'protocol'):
            self.sent_worlds.add(message.run)
        self.transcript.append(Received(self.time, message))
        publisher.publish(fill(message))

    def wait(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Spin until a condition is true, at most so many seconds; return whether it is."""
        end = time.monotonic() + seconds
        while not condition():
            check(self._stop)
            self._check_alone()
            left = end - time.monotonic()
            if left <= 0.0:
                return False
            self._executor.spin_once(timeout_sec=min(left, 0.05))
        return True

    def _check_alone(self) -> None:
        """Look once a second whether another node plays a part; raises NoNodeError."""
        if not self.name or time.monotonic() < self._next_look:
            return
        self._next_look = time.monotonic() + LOOK_PERIOD
        own = f'{self.namespace.rstrip("/")}/{self._node.get_name()}'
        for topic in (*RECEIVED[self._kind], *SENT[self._kind]):
            allowed = {self.name} if topic in RECEIVED[self._kind] else set()
            allowed |= {own} if topic in SENT[self._kind] else set()
            others = [name for name in publisher_names(self._node, topic) if name not in allowed]
            if others:
                raise NoNodeError(f'while a {self._kind} is checked, no other node must publish '
                                  f'on the topic {topic.name}, got {", ".join(others)}')

    def reset(self) -> bool:
        """Call the service `reset` of the node, if it has one."""
        response = self._call(Trigger, f'{self.name}/reset', Trigger.Request())
        return response is not None and response.success

    def restart(self, seed: int) -> bool:
        """End the node, if this check has started it, and start it with a seed."""
        if self._started is None or seed != self._seed and not self._started.has_seed:
            return False
        self.join_late()
        self._started.end()
        self.wait(lambda: not publisher_names(self._node, PARTS[self._kind]), FIND_TIME)
        for publisher, _ in self._publishers.values():
            self._node.destroy_publisher(publisher)  # or the node receives the last messages
        self._advertise()
        self._started.start(seed)
        try:
            self.find(self.name)
        except NoNodeError:
            return False
        return True

    def digest(self) -> str | None:
        """Let a learner save what it learned; return its digest, None if it cannot."""
        with tempfile.TemporaryDirectory() as folder:
            response = self._call(Save, SAVE, Save.Request(path=str(Path(folder) / 'l.npz')))
        return response.digest if response is not None and response.success else None

    def find(self, name: str) -> str:
        """
        Wait for the node to check; return its full name.

        name: that it must have; empty for any.

        Raises
        ------
        NoNodeError: if there is none, or more than one.

        """
        topic = PARTS[self._kind]

        def is_found() -> bool:
            names = publisher_names(self._node, topic)
            return name in names if name else bool(names)
        self.wait(is_found, FIND_TIME)
        names = publisher_names(self._node, topic)
        if len(names) != 1 or name not in ('', names[0]):
            raise NoNodeError(
                f'a {self._kind} must be the only publisher on the topic {topic.name}'
                + (f' and be called {name}' if name else '') + ', got '
                + (', '.join(names) or 'none') + f' within {FIND_TIME:g} s'
                + (f'; its last lines:\n{self._started.last_lines()}' if self._started else ''))
        if not self.name:
            self.name = names[0]
            for topic in RECEIVED[self._kind]:
                self._listen(topic)
            self.wait(lambda: False, QUIET)  # until it knows of these subscribers
        return self.name

    def is_gone(self) -> bool:
        """Tell whether the node has ended; one that was killed is known for `LEASE` seconds."""
        return (self.name not in publisher_names(self._node, PARTS[self._kind])
                or self._started is not None and self._started.has_ended)

    def has_ended(self) -> bool:
        """Tell whether the node has ended; wait where it has been silent for long."""
        last = max((each[-1].time for each in self.received.values() if each), default=0.0)
        return self.wait(self.is_gone, LEASE if self.time - last > PATIENCE else 0.0)

    def offered(self, topic: Topic) -> list[QoSProfile]:
        """Return the QoS of the publishers of the node on a topic."""
        return [info.qos_profile for info in self._node.get_publishers_info_by_topic(topic.name)
                if node_name(info) == self.name]

    def join_late(self) -> None:
        """Note how much of what each topic had a subscriber receives that joins now."""
        for topic in RECEIVED[self._kind]:
            count = min(topic.qos.depth, self.counts[topic.name])
            if count and all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL
                             for offer in self.offered(topic)):  # otherwise P1 says so
                self.late.append((topic.name, self._late_messages(topic, count), count))
        self.counts.clear()

    def _late_messages(self, topic: Topic, count: int) -> int:
        """Return how many messages a subscriber receives that joins now, of so many at most."""
        decode, found = decoder(topic), []

        def on_message(msg: Any) -> None:
            if topic is not WORLD or decode(msg).run not in self.sent_worlds:
                found.append(msg)
        subscription = self._node.create_subscription(
            topic.message, topic.name, on_message, topic.qos)
        self.wait(lambda: len(found) >= count, SERVICE_TIME)
        self._node.destroy_subscription(subscription)
        return len(found)

    def _call(self, kind: Any, name: str, request: Any) -> Any:
        """Return the response of a service, None without one."""
        client = self._node.create_client(kind, name)
        try:
            if not self.wait(client.service_is_ready, SERVICE_TIME):
                return None
            future = client.call_async(request)
            return future.result() if self.wait(future.done, FIND_TIME) else None
        finally:
            self._node.destroy_client(client)

    def _advertise(self) -> None:
        self._publishers = {
            topic.tuple_type.__name__: (self._node.create_publisher(
                topic.message, topic.name, topic.qos), encoder(topic))
            for topic in SENT[self._kind]}

    def _listen(self, topic: Topic) -> None:
        """Receive a topic of the node, also if that is published as it must not be."""
        decode, name, clock = decoder(topic), topic.tuple_type.__name__, self._node.get_clock()

        def on_message(msg: Any) -> None:
            values = decode(msg)
            if topic is WORLD and values.run in self.sent_worlds:
                return  # of this check itself
            now, stamp = clock.now().nanoseconds, msg.header.stamp
            self.delays.append(now / 1e9 - stamp.sec - stamp.nanosec / 1e9)
            self.counts[topic.name] += 1
            self.transcript.append(Received(self.time, values))
            self.received[name].append(self.transcript[-1])
        offers = self.offered(topic)
        reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in offers)
        latched = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offers)
        self._node.create_subscription(topic.message, topic.name, on_message, QoSProfile(
            depth=topic.qos.depth,
            reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE))
