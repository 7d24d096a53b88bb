# SPDX-License-Identifier: Apache-2.0
"""How long the parts of a callback take, in a node that runs."""

import json
from statistics import median
from time import perf_counter_ns

from rclpy.publisher import Publisher

from comply_ros.nodes import topics
from comply_ros.nodes.protocol_node import ProtocolNode
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor

HEARS = ((Learner, 'observe'), (Learner, 'on_recommendation'),
         (Mentor, 'observe'), (GridWorld, 'on_action'))
WARM = 200  # calls that are not counted


class Stopwatch:
    """
    Times the parts of every callback in this process, from when it is made.

    Parameters
    ----------
    folder: `Path` for the file.
    name: of the file, without its ending.

    """

    def __init__(self, folder, name):
        self._path, self._times = folder / f'{name}.json', {}
        decoder, encoder = topics.decoder, topics.encoder
        from comply_ros.nodes import protocol_node
        protocol_node.decoder = lambda topic: self._timed(f'decode {topic.name}', decoder(topic))
        protocol_node.encoder = lambda topic: self._timed(f'encode {topic.name}', encoder(topic))
        for owner, name in HEARS:
            setattr(owner, name, self._timed(f'actor {name}', getattr(owner, name)))
        ProtocolNode.answer = self._timed('answer, with encode and publish', ProtocolNode.answer)
        Publisher.publish = self._published(Publisher.publish)

    def _timed(self, label, function):
        times = self._times.setdefault(label, [])

        def call(*arguments):
            begin = perf_counter_ns()
            try:
                return function(*arguments)
            finally:
                times.append(perf_counter_ns() - begin)
        return call

    def _published(self, publish):
        def call(publisher, message):
            begin = perf_counter_ns()
            publish(publisher, message)
            self._times.setdefault(f'publish {publisher.topic.rsplit("/", 1)[-1]}', []).append(
                perf_counter_ns() - begin)
        return call

    def write(self):
        """Write the median time of each part, in nanoseconds: interrupted calls do not count."""
        self._path.write_text(json.dumps({
            label: median(times[WARM:])
            for label, times in self._times.items() if len(times) > WARM}))
