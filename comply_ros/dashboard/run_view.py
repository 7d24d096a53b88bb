# SPDX-License-Identifier: Apache-2.0
"""The newest reports of one run, as the page shows them; nothing is published."""

from bisect import bisect_left
from collections import OrderedDict
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.nodes.run_monitor import can_advise, can_be
from comply_ros.protocol import messages
from comply_ros.protocol.attendant import Attendant
from comply_ros.protocol.turns import FIRST
from comply_ros.protocol.validation import validate_state
from comply_ros.world.grid import Grid
from comply_ros.world.mdp import World

MAX_RUNS = 8  # whose reports are stored: reports can arrive before the description of their world
MAX_POINTS = 2000  # of a learning curve; a longer one loses every second point


class LearningCurve(NamedTuple):
    """Iterations, ascending, and the mean return of each."""

    iterations: tuple[int, ...] = ()
    returns: tuple[float, ...] = ()

    def extended(self, msg: messages.Progress) -> 'LearningCurve':
        """
        Curve that ends with the iteration of a `Progress`.

        Points from that iteration on are removed: a learner that was reset reports them again.
        A curve that is too long loses every second point, but never the newest one.
        """
        kept = bisect_left(self.iterations, msg.iteration)
        iterations = (*self.iterations[:kept], msg.iteration)
        returns = (*self.returns[:kept], msg.mean_return)
        if kept < MAX_POINTS:
            return LearningCurve(iterations, returns)
        first = 1 - len(iterations) % 2
        return LearningCurve(iterations[first::2], returns[first::2])


class RunReports(NamedTuple):
    """The newest message of each kind in one run; None where there was none."""

    observation: messages.StateReward | None = None
    action: messages.Action | None = None
    episode: messages.Episode | None = None
    progress: messages.Progress | None = None
    curve: LearningCurve = LearningCurve()
    mentor_policy: NDArray[np.int8] | None = None  # a[s], -1 for no advice
    learner_policy: NDArray[np.int8] | None = None  # a[s]
    trust: NDArray[np.float32] | None = None  # p[s] in [0, 1]


class RunSnapshot(NamedTuple):
    """A run at one moment: its world, None before it is known, and its reports."""

    description: messages.WorldDescription | None = None
    world: World | None = None
    reports: RunReports = RunReports()


class RunView(Attendant):
    """Follows one world as a mentor does, and stores the newest report of each kind."""

    def __init__(self) -> None:
        super().__init__()
        self.world: World | None = None
        self.reports: OrderedDict[int, RunReports] = OrderedDict()  # by the number of the run

    @property
    def snapshot(self) -> RunSnapshot:
        """The run that is followed, without maps that do not fit its world."""
        if self.described is None:
            return RunSnapshot()
        return RunSnapshot(self.described, self.world,
                           self.reports.get(self.described.run, RunReports()))

    def attend(self, msg: messages.WorldDescription, grid: Grid) -> tuple[()]:
        """Follow another world; return no outputs."""
        held = self._attention.attend(msg)
        if self.world is None or self.world.grid != grid:
            self.world = World(grid)
        reports, self.reports = self.reports.get(msg.run), OrderedDict()
        if reports:
            self.reports[msg.run] = self._without_misfits(reports, self.world)
        for callback, message in held:
            callback(message)
        return ()

    def observe(self, msg: messages.StateReward) -> None:
        """Store an observation; one of another run is held until its world is known."""
        attention = self._attention
        if msg.run != attention.run:
            attention.hold(self.observe, msg, 'a state')
            return
        attention.refuse_held()
        attention.silent = 0
        attention.committed |= (msg.episode, msg.step) != FIRST
        if not validate_state(msg, self.world):
            self.store(msg.run, observation=msg)

    def on_progress(self, msg: messages.Progress) -> None:
        """Store how an iteration went, and extend the learning curve."""
        if can_be(msg):
            curve = self.reports.get(msg.run, RunReports()).curve
            self.store(msg.run, progress=msg, curve=curve.extended(msg))

    def on_state_map(self, name: str, msg: messages.Trust | messages.Policy) -> None:
        """Store a map over all states as the field `name` of the reports."""
        dtype = np.float32 if name == 'trust' else np.int8
        self.store(msg.run, **{name: np.array(msg[-1], dtype=dtype)})

    def store(self, run: int, **fields: Any) -> None:
        """Change fields of the reports of a run; of too many runs, the oldest is removed."""
        reports = self.reports.get(run, RunReports())._replace(**fields)
        if run == self._attention.run and self.world is not None:
            reports = self._without_misfits(reports, self.world)
        self.reports[run] = reports
        if len(self.reports) > MAX_RUNS:
            self.reports.pop(next(each for each in self.reports if each != self._attention.run))

    @staticmethod
    def _without_misfits(reports: RunReports, world: World) -> RunReports:
        """Return the reports without the maps that do not fit the world."""
        mentor, learner, trust = reports.mentor_policy, reports.learner_policy, reports.trust
        has_trust = trust is not None and trust.shape == world.free.shape and bool(
            ((0.0 <= trust) & (trust <= 1.0)).all())
        return reports._replace(
            mentor_policy=mentor if mentor is not None and can_advise(mentor, world) else None,
            learner_policy=learner if learner is not None and can_advise(learner, world) else None,
            trust=trust if has_trust else None)
