# SPDX-License-Identifier: Apache-2.0
"""A node that watches a lesson from outside: its progress, its mentor's advice, its health."""

from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from math import nan
from pathlib import Path
import time
from typing import Any

from comply_msgs.srv import Save
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import numpy as np
from numpy.typing import NDArray
from rclpy.task import Future

from comply_ros.learner.learner_state import ONE_MENTOR
from comply_ros.nodes.clocks import steady_timer
from comply_ros.nodes.diagnostics import INACTIVE, OK, process_name, RUN, TOPIC
from comply_ros.nodes.node_processes import NodeProcess
from comply_ros.nodes.parameter_node import SafeParameterNode
from comply_ros.nodes.topics import (
    EPISODE,
    MENTOR_POLICY,
    mentors_found,
    MessageError,
    PROGRESS,
    reader,
    RECOMMENDATION,
    SAVE,
    Topic,
    topic_of_mentor,
    WORLD,
)
from comply_ros.protocol.iteration_counter import IterationCounter
from comply_ros.protocol.messages import Episode, Policy, Progress, REPORTS, WorldDescription
from comply_ros.protocol.run_reports import is_possible_progress, RunReports
from comply_ros.protocol.world_description import world_from_description
from comply_ros.world.mdp import Source, World

RATE_ITERATIONS = 20  # over which the steps per second are measured
RATE_SECONDS = 0.2  # that they must have taken together
MAX_STATUS_LENGTH = 80  # characters of a node's status that are shown
MAX_RUNS = 8  # that are remembered before it is known which one is that of the lesson
MENTOR = 'mentor'  # name of the node
FIND_PERIOD = 1.0  # seconds between two searches for other mentors
STALE = 5.0  # seconds without a report, after which latched ones are requested again


class LessonFailed(RuntimeError):
    """A lesson without results; the message says why."""


class RunMonitor(SafeParameterNode):
    """
    Collects what is reported about the run of a lesson, and ignores what cannot belong to it.

    The run of the lesson is the first whose world fits the map and in which a learner reports an
    iteration. No clock of another machine has a say in it.

    Parameters
    ----------
    namespace: of the lesson.
    source: its world.
    external: the part that the lesson does not start, '' for none.
    counter: counts the iterations of an external learner, which need not report any.
    mentors: names of the mentors of the lesson; the only one may have none.

    """

    def __init__(self, namespace: str, source: Source, external: str = '',
                 counter: IterationCounter | None = None,
                 mentors: Sequence[str] = ONE_MENTOR) -> None:
        super().__init__('lesson', namespace=namespace)
        self._external, self._counter, self._mentors = external, counter, tuple(mentors)
        self.progress: list[Progress] = []  # one for each iteration, without gaps
        self.on_progress: Callable[[Progress], Any] = lambda msg: None  # called with each
        self.processes: list[NodeProcess] = []  # whose health is read
        self.unwell: dict[str, str] = {}  # what those that are not well say, by name
        self._other_mentors: set[str] = set()  # processes of other mentors, as they were heard
        self._other_names: set[str] = set()  # of mentors that are none of the lesson
        self._world = World(source)
        self._run: int | None = None
        self.own_run: int | None = None  # the first of the world of the lesson, by its status
        # By run: what is known of those whose world fits, or whose world may still come, and the
        # times at which the world and the advice of the last mentor arrived.
        self._reports: dict[int, RunReports] = {}
        self._worlds: dict[int, float] = {}
        self._advised: dict[int, float] = {}
        self._episodes: deque[Episode] = deque()
        self._early: deque[Progress] = deque(maxlen=REPORTS)  # of runs without a world yet
        self._pace: deque[tuple[float, int]] = deque(maxlen=RATE_ITERATIONS)
        self._topics: dict[str, Any] = {}
        self._iterations_before = 0
        self._confidences: dict[tuple[int, str, int], float] = {}  # by run, mentor, iteration
        self._first_progress = 0.0
        self._subscribe(WORLD, self._on_world)
        self._subscribe_to_iterations()
        self._subscribe_to_policies()
        steady_timer(self, STALE, self._request_again)
        steady_timer(self, FIND_PERIOD, self._find_mentors)
        self.create_subscription(DiagnosticArray, TOPIC, self._on_diagnostics, 10)
        self._save = self.create_client(Save, SAVE)

    @property
    def finished(self) -> bool:
        """Whether the learner has reported all of its last iteration, and the advice is known."""
        return bool(self.progress) and self.progress[-1].finished and (
            self._run in self._advised or self._external == 'mentor') and (
            self._external == 'learner' or self._knows_confidences(self.progress[-1]))

    def confidences(self) -> dict[str, list[float]]:
        """Return the confidence in each mentor in each iteration; nan where none was reported."""
        if len(self._mentors) == 1:
            return {self._mentors[0]: [msg.confidence for msg in self.progress]}
        return {name: [self._confidences.get((msg.run, name, msg.iteration), nan)
                       for msg in self.progress] for name in self._mentors}

    def _knows_confidences(self, msg: Progress) -> bool:
        return len(self._mentors) == 1 or all(
            (msg.run, name, msg.iteration) in self._confidences for name in self._mentors)

    @property
    def own_run_known(self) -> bool:
        """Whether the world of the lesson has said which run it has."""
        return self.own_run is not None

    @property
    def follows_another_world(self) -> bool:
        """Whether the learner has learned in the world of others, which was heard first."""
        return None not in (self._run, self.own_run) and self._run != self.own_run

    @property
    def advice(self) -> NDArray[Any] | None:
        """
        `advice[s]` that the mentor published in the run; None where an external one did not.

        Of several mentors in rows, `advice[m * n_states + s]`.
        """
        reports = self._reports.get(self.progress[0].run)
        return reports and _advice_of(reports, self._mentors)

    def seconds(self) -> float:
        """
        Return the seconds since both the world and the mentor of the run were there.

        Since the world was there, if the mentor's policy came after the first iteration.
        """
        run = self.progress[0].run
        begin = max(self._worlds[run], self._advised.get(run, 0.0))
        return time.monotonic() - (begin if begin <= self._first_progress else self._worlds[run])

    def rate(self) -> float | None:
        """Return the steps per second over the last iterations, None where that is too short."""
        (first, steps_before), (last, steps) = self._pace[0], self._pace[-1]
        return (steps - steps_before) / (last - first) if last - first > RATE_SECONDS else None

    def save(self, path: Path) -> Future:
        """Ask the learner of this lesson to write what it learned; return the future response."""
        steps = 0 if self._external == 'learner' else self.progress[-1].steps  # 0: not compared
        return self._save.call_async(Save.Request(path=str(path), steps=steps))

    @property
    def can_save(self) -> bool:
        """Whether there is a learner that writes what it learned."""
        return self._save.service_is_ready()

    def most_publishers(self) -> int:
        """Return the largest number of publishers on a topic of what the lesson starts."""
        topics = {'world': WORLD, 'learner': PROGRESS}
        return max(self.count_publishers(topic.name) for part, topic in topics.items()
                   if part != self._external)

    def other_mentors(self, respawns: bool) -> int:
        """
        Return how many mentors besides that of the lesson have been heard.

        respawns: whether publishers do not count: those of a killed node are seen for a while.
        """
        publishers = 0 if respawns else sum(
            max(0, self.count_publishers(topic_of_mentor(RECOMMENDATION, name).name) - 1)
            for name in self._mentors)
        return len(self._other_names) + max(publishers, len(self._other_mentors))

    def _find_mentors(self) -> None:
        """Remember the names of mentors that are found, and are none of the lesson."""
        self._other_names |= {*mentors_found(self)} - {*self._mentors}

    def _note_mentor(self, status: DiagnosticStatus) -> None:
        """Remember a status of another node `mentor` in the namespace of the lesson."""
        if self._external == MENTOR:
            return  # it may have any name
        own = {process_name(pid) for process in self.processes for pid in process.pids}
        name = f'{self.get_namespace()}/{MENTOR}'.lstrip('/')
        if status.name == name and status.hardware_id not in own:
            self._other_mentors.add(status.hardware_id)

    def _subscribe(self, topic: Topic, receive: Callable[[Any], None]) -> None:
        """Subscribe; where that was done before, latched messages come once more."""
        if topic.name in self._topics:
            self.destroy_subscription(self._topics[topic.name])
        read = reader(topic)

        def callback(content: bytes) -> None:
            try:
                msg = read(content)
            except MessageError:
                return  # it cannot belong to the run
            receive(msg)
        self._topics[topic.name] = self.create_subscription(
            topic.message, topic.name, callback, topic.qos, raw=True)

    def _subscribe_to_policies(self) -> None:
        for name in self._mentors:
            self._subscribe(topic_of_mentor(MENTOR_POLICY, name), partial(self._on_policy, name))

    def _subscribe_to_iterations(self) -> None:
        counter = self._counter
        if counter is None:
            self._subscribe(PROGRESS, self._on_progress)
            return

        def on_episode(msg: Episode) -> None:
            self._episodes.append(msg)  # until it is known which run is that of the lesson
            while self.own_run is not None and self._episodes:
                each = self._episodes.popleft()
                if each.run == self.own_run:
                    _check_complete(counter, each)
                    if progress := counter.add(each):
                        self._on_progress(progress)
        self._subscribe(EPISODE, on_episode)

    def _request_again(self) -> None:
        """Subscribe again where nothing came for a while: a crowd may have pushed it out."""
        if self._worlds and self._run not in self._advised:
            self._subscribe_to_policies()
        if self._worlds and len(self.progress) == self._iterations_before:
            self._subscribe_to_iterations()
        self._iterations_before = len(self.progress)

    def _on_world(self, msg: WorldDescription) -> None:
        """Remember a world that fits, and take the progress that came before it."""
        if self._run is not None or len(self._worlds) == MAX_RUNS or not self._fits(msg):
            return
        self._worlds.setdefault(msg.run, time.monotonic())
        early, self._early = self._early, deque(maxlen=REPORTS)
        for each in early:
            self._on_progress(each)

    def _fits(self, msg: WorldDescription) -> bool:
        try:
            return (msg.sha256 in ('', self._world.sha256)
                    and world_from_description(msg) == self._world.source)
        except ValueError:
            return False

    def _on_policy(self, name: str, msg: Policy) -> None:
        """Remember advice for the run of the lesson, or for any run while that is not known."""
        if msg.run != self._run and (self._run is not None or msg.run not in self._reports
                                     and len(self._reports) == MAX_RUNS):
            return
        reports = self._reports.setdefault(msg.run, RunReports())
        before = reports.mentors
        reports.add(topic_of_mentor(MENTOR_POLICY, name).name, msg)
        if reports.validate_map(self._world, MENTOR_POLICY.name, name):
            reports.mentors = before
        elif msg.run not in self._advised and _advice_of(reports, self._mentors) is not None:
            self._advised[msg.run] = time.monotonic()

    def _on_progress(self, msg: Progress) -> None:
        """
        Take the next iteration; one that a restarted learner repeats is known.

        Its confidence in each of several mentors is no result of its own.
        """
        if self._run is None and msg.run not in self._worlds:
            self._early.append(msg)  # its world may still come
            return
        if self._run not in (None, msg.run) or not is_possible_progress(msg):
            return
        if msg.mentor:
            self._confidences[msg.run, msg.mentor, msg.iteration] = msg.confidence
            return
        done = len(self.progress)
        if msg.iteration != done + 1 or done and msg.steps <= self.progress[-1].steps:
            return
        if self._run is None:
            self._first_progress = time.monotonic()
        self._run = msg.run
        self.progress.append(msg)
        self._pace.append((time.monotonic(), msg.steps))
        self.on_progress(msg)

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        """Remember what nodes that are not well say; raises LessonFailed if one is inactive."""
        names = {process_name(process.pid): process.name for process in self.processes}
        for status in msg.status:
            self._note_mentor(status)
            name = names.get(status.hardware_id)
            if name is None:
                continue
            for each in status.values if self.own_run is None else ():
                if each.key == RUN:
                    self.own_run = int(each.value)
            if status.message.startswith(INACTIVE):
                raise LessonFailed(f'{name} {status.message}')
            self.unwell.pop(name, None)
            if status.level != OK:
                self.unwell[name] = \
                    f'{name} {" ".join(status.message.split())}'[:MAX_STATUS_LENGTH]


def _advice_of(reports: RunReports, names: Sequence[str]) -> NDArray[Any] | None:
    """Return the policies of mentors in rows; None while one is not known."""
    policies = [reports.of_mentor(name).policy for name in names]
    known = [each for each in policies if each is not None]
    return np.concatenate(known) if len(known) == len(policies) else None


def _check_complete(counter: IterationCounter, msg: Episode) -> None:
    """Raise LessonFailed if an episode before this one was lost, and the world has it no more."""
    missing = counter.missing_before(msg)
    if missing >= REPORTS:
        raise LessonFailed(f'the world reported {missing} episodes before episode {msg.episode} '
                           'that did not arrive here, so iterations cannot be counted: give the '
                           'world a rate')
