# SPDX-License-Identifier: Apache-2.0
"""Who watches a lesson from outside: a node that listens to what is reported."""

from collections import deque
from math import isfinite
import time

from comply_msgs.srv import Save
from diagnostic_msgs.msg import DiagnosticArray
import numpy as np

from comply_ros.nodes.diagnostics import OK, process_name, STANDS_ASIDE, TOPIC
from comply_ros.nodes.parameters import SafeParameterNode
from comply_ros.nodes.topics import decoder, MENTOR_POLICY, PROGRESS, SAVE, WORLD
from comply_ros.protocol.messages import grid_from_description, REPORTS
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World

TAKEN = ('other nodes speak on the topics of this lesson: end them, or give this one a '
         '--namespace of its own')
PACE = 20  # iterations over which the steps per second are measured
SHORTEST = 0.2  # seconds that they must have taken together
LONGEST_WORDS = 80  # characters of what a node says of itself
WORLDS = 8  # whose mentors are remembered while it is open which one is that of the lesson
STALE = 5.0  # seconds without a report after which the last ones are asked for again


class LessonFailed(RuntimeError):
    """A lesson without results; the message says why."""


class RunMonitor(SafeParameterNode):
    """
    Listens to what is reported, and keeps it; what cannot belong to it is passed over.

    Parameters
    ----------
    namespace: of the nodes.
    grid: the `Grid` that the lesson is held in.
    on_progress: called with each `Progress`.

    Attributes
    ----------
    progress: list of `Progress`, one an iteration, without gaps.
    advice: `advice[s]` that the mentor published, None before.
    began: when world and mentor were both there, in seconds of the monotonic clock; None before.
    words: what each node that is not well says of itself, by name.

    """

    def __init__(self, namespace, grid, on_progress):
        super().__init__('lesson', namespace=namespace)
        self.progress, self.advice, self.began, self.words = [], None, None, {}
        self._world, self._policies, self._early = None, {}, deque(maxlen=REPORTS)
        self._mdp, self._before = World(grid), 0
        self._pace = deque(maxlen=PACE)
        self._processes = ()
        self._report = on_progress
        self._listen(WORLD, self._on_world)
        self._ears = {}
        self._listen_anew(PROGRESS, self._on_progress)
        self._listen_anew(MENTOR_POLICY, self._on_policy)
        self.create_timer(STALE, self._look)
        self.create_subscription(DiagnosticArray, TOPIC, self._on_diagnostics, 10)
        self._save = self.create_client(Save, SAVE)

    def _listen(self, topic, hear):
        decode = decoder(topic)
        return self.create_subscription(topic.message, topic.name,
                                        lambda message: hear(decode(message)), topic.qos)

    def _look(self):
        """Listen anew where nothing came for a while: what a crowd pushed out is latched."""
        if self._world and self.advice is None:
            self._listen_anew(MENTOR_POLICY, self._on_policy)
        if self._world and len(self.progress) == self._before:
            self._listen_anew(PROGRESS, self._on_progress)
        self._before = len(self.progress)

    def _listen_anew(self, topic, hear):
        if topic.name in self._ears:
            self.destroy_subscription(self._ears[topic.name])
        self._ears[topic.name] = self._listen(topic, hear)

    def follow(self, processes):
        """Take the health of these nodes, which can be started again, for that of the lesson."""
        self._processes = processes

    def rate(self):
        """Return the steps per second over the last iterations, None where they cannot be told."""
        (first, before), (last, now) = self._pace[0], self._pace[-1]
        return (now - before) / (last - first) if last - first > SHORTEST else None

    def save(self, path):
        """Ask the learner of this lesson to write what it learned; return the future response."""
        return self._save.call_async(
            Save.Request(path=str(path), steps=self.progress[-1].steps))

    def speakers(self):
        """Return the largest number of nodes that speak on one topic of a lesson."""
        return max(len(self.get_publishers_info_by_topic(self.resolve_topic_name(topic.name)))
                   for topic in (WORLD, PROGRESS))

    def _on_world(self, msg):
        """Take the world that began first for that of the lesson, and hear what came before it."""
        if self._world is not None and (self.progress or msg.began >= self._world.began):
            return
        if not self._is_held_in(msg):
            return
        self._world, self.advice = msg, None
        for each in [*self._policies.values()]:
            self._on_policy(each)
        early, self._early = self._early, deque(maxlen=REPORTS)
        for each in early:
            self._on_progress(each)

    def _is_held_in(self, msg):
        if msg.sha256 != self._mdp.grid.sha256:
            return False
        try:
            return grid_from_description(msg) == self._mdp.grid
        except ValueError:
            return False

    def _on_policy(self, msg):
        if not self.progress and len(self._policies) < WORLDS:
            self._policies[msg.run] = msg
        if self._world and msg[:3] == (self._world.run, self._world.width, self._world.height) \
                and can_advise(msg.action, self._mdp):
            self.advice = np.array(msg.action, dtype=np.int8)
            self.began = self.began or time.monotonic()

    def _on_progress(self, msg):
        """Take the next iteration; one that a restarted learner says again is known."""
        if self._world is None or msg.run != self._world.run and not self.progress:
            self._early.append(msg)  # of a world that may be heard yet, and have begun before
            return
        if msg.run != self._world.run or not can_be(msg):
            return
        already = len(self.progress)
        if msg.iteration != already + 1 or already and msg.steps <= self.progress[-1].steps:
            return
        self.progress.append(msg)
        self._pace.append((time.monotonic(), msg.steps))
        self._report(msg)

    def _on_diagnostics(self, msg):
        """
        Remember what a node of this lesson says that is not well.

        Raises
        ------
        LessonFailed: if it stands aside for another.

        """
        ours = {process_name(process.pid): process.name for process in self._processes}
        for status in msg.status:
            name = ours.get(status.hardware_id)
            if name is None:
                continue
            if status.message.startswith(STANDS_ASIDE):
                raise LessonFailed(f'{name} {status.message}')
            self.words.pop(name, None)
            if status.level != OK:
                self.words[name] = f'{name} {" ".join(status.message.split())}'[:LONGEST_WORDS]


def can_be(msg):
    """Tell whether a `Progress` can be right: its numbers are what the message promises."""
    return (isfinite(msg.mean_return) and 0.0 <= msg.temperature < float('inf')
            and (msg.confidence != msg.confidence or 0.0 <= msg.confidence <= 1.0)
            and msg.episodes > 0 and msg.finished == (msg.iteration == msg.iterations))


def can_advise(action, world):
    """Tell whether advice for all states is of actions that the cells have, or none."""
    advice = np.array(action, dtype=np.int64)
    if advice.shape != world.free.shape or not ((NO_ACTION <= advice) & (advice < 4)).all():
        return False
    has = world.available[np.arange(len(advice)), advice]
    return bool((has | (advice == NO_ACTION) | ~world.free).all())
