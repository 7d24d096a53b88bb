# SPDX-License-Identifier: Apache-2.0
"""The time that each part of a callback takes, in a running node."""

from collections.abc import Callable
import json
from pathlib import Path
from statistics import median
from time import perf_counter_ns
from typing import Any

from rclpy.publisher import Publisher

from comply_ros.nodes import cdr
from comply_ros.nodes.protocol_node import ProtocolNode
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor

ACTOR_METHODS = ((Learner, 'observe'), (Learner, 'on_recommendation'),
                 (Mentor, 'observe'), (GridWorld, 'on_action'))
WARM_UP = 200  # calls that are not counted


class CallbackTimer:
    """
    Times the parts of every callback of this process, from when it is made.

    Parameters
    ----------
    path: of the JSON file that `write` makes.

    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._times: dict[str, list[int]] = {}
        decoder, encoder = cdr.decoder, cdr.encoder
        setattr(cdr, 'decoder', lambda message, tuple_type: self._timed(
            f'decode {message.__name__}', decoder(message, tuple_type)))
        setattr(cdr, 'encoder', lambda message, clock: self._timed(
            f'encode {message.__name__}', encoder(message, clock)))
        for owner, name in ACTOR_METHODS:
            setattr(owner, name, self._timed(f'actor {name}', getattr(owner, name)))
        setattr(ProtocolNode, 'respond', self._timed(
            'respond, with encode and publish', ProtocolNode.respond))
        publish = Publisher.publish
        setattr(Publisher, 'publish', lambda publisher, message: self._call(
            f'publish {publisher.topic.rsplit("/", 1)[-1]}', publish, publisher, message))

    def _timed(self, label: str, function: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *arguments: self._call(label, function, *arguments)

    def _call(self, label: str, function: Callable[..., Any], *arguments: Any) -> Any:
        start = perf_counter_ns()
        try:
            return function(*arguments)
        finally:
            self._times.setdefault(label, []).append(perf_counter_ns() - start)

    def write(self) -> None:
        """Write the median time of each part, in ns: interrupted calls do not change it."""
        self._path.write_text(json.dumps({
            label: median(times[WARM_UP:])
            for label, times in self._times.items() if len(times) > WARM_UP}))
