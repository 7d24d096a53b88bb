# SPDX-License-Identifier: Apache-2.0
"""What is known of a run from its topics: for viewer, page, run monitor, plots and replay."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from comply_ros.protocol.mentor_topics import topic_and_mentor
from comply_ros.protocol.message_validation import validate_observation
from comply_ros.protocol.messages import Outputs, StateReward, step_id, StepId
from comply_ros.protocol.run_reports import mentor_of, RunReports
from comply_ros.protocol.run_tracker import RunTracker
from comply_ros.protocol.state_maps import STATE_MAPS
from comply_ros.world.mdp import World

MAX_RUNS = 8  # other runs with reports: these can arrive before the description of their world


class RunView:
    """
    Follows one run as a mentor does, publishes nothing, and has the newest reports of that run.

    Parameters
    ----------
    on_new_run: called when another run is followed; returns outputs.
    trail_length: states of the episode that `trail` has at most.
    history: see `RunReports`.

    Attributes
    ----------
    tracker: which world and run it follows.
    reports: of the run that is followed.
    trail: states of this episode, oldest first, each different from the one before.
    changed: topics of this run with a new message, those of any mentor by the name without it;
        whoever shows them clears the set.

    """

    def __init__(self, on_new_run: Callable[[bool], Outputs] = lambda is_reset: (),
                 trail_length: int = 0, history: bool = False) -> None:
        self.tracker = RunTracker(self._start_run)
        self.trail: list[int] = []
        self.changed: set[str] = set()
        self.reports = RunReports(history)
        self._on_new_run, self._trail_length, self._history = on_new_run, trail_length, history
        self._others: OrderedDict[int, RunReports] = OrderedDict()
        self._last: StepId | None = None

    @property
    def world(self) -> World | None:
        """The world of the run that is followed, None before the first."""
        return self.tracker.world

    def waiting_for(self) -> str | None:
        """Text of what it needs before there is anything to show, or None."""
        return self.tracker.waiting_for() if self.world is None else None

    def tick(self) -> Outputs:
        """Once a second: follow another world if this one is gone; return outputs."""
        return self.tracker.tick()

    def receive(self, topic: str, msg: Any) -> Outputs:
        """
        Take the next message on a topic; return outputs, which are only to be logged.

        topic: its name, of a mentor as `name_of_mentor` makes it.

        Raises
        ------
        ValueError: for a `WorldDescription` that does not describe a world.

        """
        if topic == 'world':
            return self.tracker.on_world(msg)
        if topic == 'state':
            return self._observe(msg)
        run = msg.run
        if run != self.tracker.run:
            reports = self._others.pop(run, None) or RunReports(self._history)
            self._others[run] = reports
            if len(self._others) > MAX_RUNS:
                self._others.popitem(last=False)
            reports.add(topic, msg)
            return ()
        self.reports.add(topic, msg)
        kind, _ = topic_and_mentor(topic)
        self.changed.add(kind)
        if kind in STATE_MAPS and self.world is not None:
            return tuple(self.reports.validate_map(self.world, kind, mentor_of(topic, msg)))
        return ()

    def _observe(self, msg: StateReward) -> Outputs:
        """Take an observation; return why it cannot be right."""
        if msg.run != self.tracker.run or self.world is None:
            return self.tracker.hold(self._observe, msg, 'a state')
        problem = validate_observation(msg, self.world)
        if problem:
            return (problem,)
        self.tracker.continues()
        here, before = step_id(msg), self._last
        if here == before:
            return ()
        self._last = here
        self.reports.add('state', msg)
        self.changed.add('state')
        if self._trail_length:
            if before is None or before[0] != here[0] or here < before:
                self.trail = []
            if not self.trail or self.trail[-1] != msg.state:
                self.trail = [*self.trail, msg.state][-self._trail_length:]
        return ()

    def _start_run(self, is_reset: bool) -> Outputs:
        description = self.tracker.description
        assert description is not None and self.world is not None
        self.reports = self._others.pop(description.run, None) or RunReports(self._history)
        self._others.clear()
        self.reports.add('world', description)
        self.trail, self._last = [], None
        self.changed = {'world', 'state', 'progress', *STATE_MAPS}
        return (*self.reports.validate_maps(self.world), *self._on_new_run(is_reset))
