# SPDX-License-Identifier: Apache-2.0
"""The time that each part of a callback takes, in a running node."""

from collections.abc import Callable
import json
from pathlib import Path
from statistics import median
from time import perf_counter_ns
from typing import Any

from rclpy.publisher import Publisher

from comply_ros.nodes import cdr, protocol_node
from comply_ros.nodes.protocol_node import ProtocolNode
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.world import WorldMachine

ACTOR_METHODS = ((Learner, 'observe'), (Learner, 'on_recommendation'),
                 (Mentor, 'observe'), (WorldMachine, 'on_action'))
WARM_UP = 200  # calls that are not counted


class CallbackTimer:
    """
    Times the parts of every callback of this process, from when it is made.

    A part in which something is published is timed without `publish`.

    Parameters
    ----------
    path: of the JSON file that `write` makes.

    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._times: dict[str, list[int]] = {}
        self._published = 0  # nanoseconds in `publish` so far
        decoder, encoder = cdr.decoder, cdr.encoder
        setattr(cdr, 'decoder', lambda message, tuple_type: self._timed(
            f'decode {message.__name__}', decoder(message, tuple_type)))
        setattr(cdr, 'encoder', lambda message, clock: self._timed(
            f'encode {message.__name__}', encoder(message, clock)))
        for owner, name in ACTOR_METHODS:
            setattr(owner, name, self._timed(f'actor {name}', getattr(owner, name)))
        setattr(ProtocolNode, 'respond', self._timed(
            'respond, with encode', ProtocolNode.respond))
        publish = Publisher.publish
        setattr(Publisher, 'publish', lambda publisher, message: self._publish(
            publish, publisher, message))

    def _timed(self, label: str, function: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *arguments, **named: self._call(label, function, *arguments, **named)

    def _call(self, label: str, function: Callable[..., Any], *arguments: Any,
              **named: Any) -> Any:
        start, published = perf_counter_ns(), self._published
        try:
            return function(*arguments, **named)
        finally:
            self._times.setdefault(label, []).append(
                perf_counter_ns() - start - self._published + published)

    def _publish(self, publish: Callable[..., Any], publisher: Publisher, message: Any) -> None:
        label, start = f'publish {publisher.topic.rsplit("/", 1)[-1]}', perf_counter_ns()
        publish(publisher, message)
        spent = perf_counter_ns() - start
        self._published += spent
        self._times.setdefault(label, []).append(spent)

    def write(self) -> None:
        """Write the median time of each part, in ns: interrupted calls do not change it."""
        self._path.write_text(json.dumps({
            label: median(times[WARM_UP:])
            for label, times in self._times.items() if len(times) > WARM_UP}))


class ReactionTimer:
    """
    Times from a message received, as bytes, to the first message handed to `publish` for it.

    Parameters
    ----------
    path: of the JSON file that `write` makes.

    """

    def __init__(self, path: Path) -> None:
        self._path, self._received = path, 0
        self._times: list[int] = []
        make_reader, publish = protocol_node.reader, Publisher.publish
        setattr(protocol_node, 'reader', lambda topic: self._started(make_reader(topic)))
        setattr(Publisher, 'publish', lambda publisher, message: self._publish(
            publish, publisher, message))

    def _started(self, read: Callable[[bytes], Any]) -> Callable[[bytes], Any]:
        def read_and_start(content: bytes) -> Any:
            self._received = perf_counter_ns()
            return read(content)
        return read_and_start

    def _publish(self, publish: Callable[..., Any], publisher: Publisher, message: Any) -> None:
        received, self._received = self._received, 0
        if received:
            self._times.append(perf_counter_ns() - received)
        publish(publisher, message)

    def write(self) -> None:
        """Write the median of all times after the warm-up, in ns."""
        times = self._times[WARM_UP:]
        self._path.write_text(json.dumps(
            {'from a message received to `publish`': median(times)} if times else {}))
