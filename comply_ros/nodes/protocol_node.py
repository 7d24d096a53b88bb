# SPDX-License-Identifier: Apache-2.0
"""The base class of the three nodes: a state machine of `protocol` behind topics and services."""

from collections.abc import Callable
import time
from typing import Any

from comply_ros.nodes.checkpointing import Checkpointing
from comply_ros.nodes.clocks import StampClock, steady_timer, waiting_for
from comply_ros.nodes.diagnostics import Diagnostics, ERROR, INACTIVE, OK, WARN
from comply_ros.nodes.parameter_node import SafeParameterNode
from comply_ros.nodes.parameters import STATE_DIR
from comply_ros.nodes.topic_type_check import TopicTypeCheck
from comply_ros.nodes.topics import LOOP, MessageError, reader, Topic, writer
from comply_ros.protocol.messages import (
    Ignored,
    Inactive,
    Notice,
    Outputs,
    Recommendation,
    Rejected,
)

PATIENCE = 3  # seconds of waiting after which a node logs what it waits for
RETRY = 0.2  # seconds between two attempts to write what the disk did not take


class ProtocolNode(SafeParameterNode):
    """
    A node that writes what its state machine received to the journal, then publishes its outputs.

    Attributes
    ----------
    machine: the state machine.
    diagnostics: counts of rejected and ignored messages.
    checkpointing: writes its state.
    mistake: an exception of a callback, which ends the node.

    """

    machine: Any

    def __init__(self, name: str, **kwargs: Any) -> None:
        super().__init__(name, **kwargs)
        self.machine, self.mistake = None, None
        self.diagnostics, self._type_check = Diagnostics(self), TopicTypeCheck(self)
        self.checkpointing = Checkpointing(self, self.declare(STATE_DIR))
        self._stamp_clock = StampClock(self)
        self._own_publishers: list[Any] = []
        self._own_services: list[Any] = []
        self._pending: Outputs | None = None  # until the state is on disk
        self._inactive: str | None = None
        self._wait_status: tuple[str | None, float, bool] = None, 0.0, False
        self._waited_at: int | None = None  # the step count at which a wait was logged
        self._handlers: dict[type, Callable[[Any], None]] = {
            Rejected: self._log_rejected, Ignored: self._log_ignored, Notice: self._log_notice,
            Inactive: self._become_inactive}
        self._retry = steady_timer(self, RETRY, self._try_again)
        self._retry.cancel()
        steady_timer(self, 1.0, self._tick)

    def advertise(self, topic: Topic) -> None:
        """Make a publisher; outputs of the topic's tuple type are published there."""
        publisher = self.create_publisher(topic.message, topic.name, topic.qos,
                                          **_fixed_qos(topic))
        encode = writer(topic, self._stamp_clock.nanoseconds)
        publish = publisher.publish
        self._own_publishers.append(publisher)
        self._handlers[topic.tuple_type] = lambda output: publish(encode(output))
        self._type_check.watch(topic)

    def serve(self, kind: Any, name: str, reply: Callable[[Any, Any], Any]) -> None:
        """Make a service."""
        self._own_services.append(self.create_service(kind, name, reply))

    def subscribe(self, topic: Topic, handler: Callable[[Any], Outputs],
                  also_blocked: bool = False) -> None:
        """
        Subscribe: every message is decoded and handled, and the outputs are published.

        also_blocked: whether messages are handled while the state cannot be written. Others are
            not, since their publishers repeat them.

        """
        read = reader(topic)

        def callback(content: bytes) -> None:
            if self._pending is not None and not also_blocked:
                return
            try:
                msg = read(content)
            except MessageError as error:
                self._log_rejected(Rejected(f'unreadable {topic.name}', str(error)))
                return
            outputs = handler(msg)
            if self._pending is not None:
                self.publish(outputs)
            elif outputs:
                self.respond(outputs)
        self.create_subscription(topic.message, topic.name, callback, topic.qos, raw=True,
                                 **_fixed_qos(topic))
        self._type_check.watch(topic, single_publisher=topic.tuple_type is Recommendation)

    @property
    def blocked(self) -> bool:
        """Tell whether outputs wait until the state can be written."""
        return self._pending is not None

    def respond(self, outputs: Outputs) -> None:
        """Write what the state machine received, then publish the outputs; else wait for that."""
        if not outputs or self.mistake:  # which ends the node: its state stays as it is
            return
        if self._pending is not None:
            self._pending = (*self._pending, *outputs)
        elif self.checkpointing.save(self.machine):
            self.publish(outputs)
        else:
            self._block(outputs)

    def publish(self, outputs: Outputs) -> None:
        """Publish, or log, each of the outputs."""
        handlers = self._handlers
        for output in outputs:
            handlers[type(output)](output)

    def tick(self) -> Outputs:
        """Return the outputs that are due once a second."""
        return self.machine.tick()

    def leave(self) -> None:
        """Close the state: the node ends."""
        self.checkpointing.close()

    def status_text(self) -> str:
        """Text of what the node does while all is well."""
        return 'runs'

    def waiting_for(self) -> str | None:
        """Return what the node waits for, None where it has all that it needs."""
        return waiting_for(self, self.machine.waiting_for())

    def _try_again(self) -> None:
        """Write what could not be written before, then publish what waited for it."""
        if self._pending is not None and self.checkpointing.save(self.machine):
            self._retry.cancel()
            self.machine.allow_gap()
            pending, self._pending = self._pending, None
            self.publish(pending)

    def _block(self, pending: Outputs) -> None:
        """Publish and handle nothing until the state can be written."""
        self._pending = pending
        self._retry.reset()

    def _tick(self) -> None:
        """Once a second: check the state machine, the disk and the topics; publish the status."""
        if self.machine is None or self.mistake:
            return
        if self._pending is None and not self.checkpointing.save_if_removed(self.machine):
            self._block(())
        elif self._pending is None:
            self.respond(self.tick())
        for problem in self._type_check.tick():
            self.get_logger().warning(problem)
        self.diagnostics.publish(*self._status(), self.machine.step_count,
                                 self.checkpointing.store, self.own_run())

    def own_run(self) -> int | None:
        """Return the run of a world; None for any other node."""
        return None

    def _status(self) -> tuple[bytes, str]:
        """Level and text of the status; what the node waits for is logged once."""
        what, since, logged = self._wait_status
        now, step_count = self.waiting_for(), self.machine.step_count
        if self._waited_at not in (None, step_count):
            self.get_logger().info('continues')
            what, self._waited_at = None, None
        if now != what:
            since, logged = time.monotonic(), False
        waits_long = bool(now) and time.monotonic() - since >= PATIENCE - 0.5
        if waits_long and not logged and not self._inactive:
            self.get_logger().warning(f'waits for {now}')
            self._waited_at = step_count
        self._wait_status = now, since, logged or waits_long
        if self._inactive or self.checkpointing.error:
            return ERROR, self._inactive or self.checkpointing.error or ''
        return (WARN, f'waits for {now}') if waits_long else (OK, self.status_text())

    def _log_rejected(self, output: Rejected) -> None:
        self.diagnostics.rejected[output.kind] += 1
        if self.diagnostics.rejected[output.kind] == 1:
            self.get_logger().warning(f'rejected: {output.reason} (logged once, counted)')

    def _log_ignored(self, output: Ignored) -> None:
        self.diagnostics.ignored[output.kind] += 1
        if self.diagnostics.ignored[output.kind] == 1:
            logger = self.get_logger()  # what is late or twice belongs to every run at a low rate
            log = logger.debug if output.kind.endswith('too late') else logger.info
            log(f'{output.reason} (harmless; logged once, counted)')

    def _log_notice(self, output: Notice) -> None:
        self.get_logger().info(output.text)

    def _become_inactive(self, output: Inactive) -> None:
        """Publish nothing any more: the publishers and services of this node are gone."""
        self._inactive = f'{INACTIVE}: {output.reason}'
        self.get_logger().error(self._inactive)
        for publisher in self._own_publishers:
            self.destroy_publisher(publisher)
        for service in self._own_services:
            self.destroy_service(service)
        self._handlers = dict.fromkeys(self._handlers, lambda output: None)


def _fixed_qos(topic: Topic) -> dict[str, None]:
    """Return settings of a topic whose QoS must not be overridden: nothing may be lost there."""
    in_loop = topic in LOOP or topic.tuple_type is Recommendation
    return {'qos_overriding_options': None} if in_loop else {}


def map_text(name: str, sha256: str) -> str:
    """Name of a map with the hash that tells it from every other map of that name."""
    return f'{name} ({sha256[:12]})'
