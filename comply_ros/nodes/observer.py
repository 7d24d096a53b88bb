# SPDX-License-Identifier: Apache-2.0
"""Who watches a lesson from outside: a node that listens to what is reported."""

import time

from comply_msgs.srv import Save
import numpy as np
from rclpy.node import Node

from comply_ros.nodes.topics import decoder, MENTOR_POLICY, PROGRESS, SAVE, WORLD

TAKEN = ('other nodes speak on the topics of this lesson: end them, or give this one a '
         '--namespace of its own')


class LessonFailed(RuntimeError):
    """A lesson without results; the message says why."""


class Observer(Node):
    """
    Listens to what is reported, and keeps it.

    Attributes
    ----------
    progress: list of `Progress`, one an iteration, without gaps.
    advice: `advice[s]` that the mentor published, None before.
    began: when world and mentor were both there, in seconds of the monotonic clock; None before.

    """

    def __init__(self, namespace, on_progress):
        super().__init__('lesson', namespace=namespace)
        self.progress, self.advice, self.began = [], None, None
        self._on_progress = on_progress
        for topic, hear in ((PROGRESS, self._hear_progress), (WORLD, self._hear_world),
                            (MENTOR_POLICY, self._hear_policy)):
            self._listen(topic, decoder(topic), hear)
        self._described = False
        self._save = self.create_client(Save, SAVE)

    def _listen(self, topic, decode, hear):
        self.create_subscription(topic.message, topic.name,
                                 lambda message: hear(decode(message)), topic.qos)

    def rate(self, said):
        """Return the steps per second up to a `Progress`, None where they cannot be told."""
        return said.steps / (time.monotonic() - self.began) if self.began else None

    def save(self, path):
        """Ask the learner to write what it learned; return the future of its response."""
        return self._save.call_async(Save.Request(path=str(path)))

    def speakers(self):
        """Return the largest number of nodes that speak on one topic of a lesson."""
        return max(len(self.get_publishers_info_by_topic(self.resolve_topic_name(topic.name)))
                   for topic in (WORLD, PROGRESS))

    def _hear_world(self, said):
        self._described = True
        self._begin()

    def _hear_policy(self, said):
        self.advice = np.array(said.action, dtype=np.int8)
        self._begin()

    def _begin(self):
        if self.began is None and self._described and self.advice is not None:
            self.began = time.monotonic()

    def _hear_progress(self, said):
        if said.iteration != len(self.progress) + 1:
            raise LessonFailed(f'iteration {len(self.progress) + 1} must be reported next, '
                               f'got iteration {said.iteration}: {TAKEN}')
        self.progress.append(said)
        self._on_progress(said)
