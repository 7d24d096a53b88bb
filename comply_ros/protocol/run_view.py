# SPDX-License-Identifier: Apache-2.0
"""What is known of a run from its topics: for viewer, page, run monitor, plots and replay."""

from __future__ import annotations

from bisect import bisect_left
from collections import OrderedDict
from collections.abc import Callable
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.mentor.policy_validation import PolicyError, validate_policy
from comply_ros.protocol.messages import (
    Action,
    Episode,
    LearnerDescription,
    Outputs,
    Progress,
    Rejected,
    StateReward,
    step_id,
    StepId,
    WorldDescription,
)
from comply_ros.protocol.run_tracker import RunTracker
from comply_ros.protocol.validation import validate_observation
from comply_ros.world.mdp import World

MAX_RUNS = 8  # other runs with reports: these can arrive before the description of their world
MAX_POINTS = 2000  # of a learning curve; a longer one loses every second point
# Topics with a value for each state, and the field and type of these values.
STATE_MAPS = {'trust': ('confidence', np.float32), 'policy': ('action', np.int16),
              'values': ('value', np.float64), 'mentor_policy': ('action', np.int16)}


class LearningCurve(NamedTuple):
    """Iterations, ascending, and the mean return of each."""

    iterations: tuple[int, ...] = ()
    returns: tuple[float, ...] = ()

    def extended(self, msg: Progress) -> LearningCurve:
        """
        Return the curve that ends with the iteration of a `Progress`.

        Points from that iteration on are removed: a learner that was reset reports them again.
        A curve that is too long loses every second point, but never the newest one.
        """
        count = bisect_left(self.iterations, msg.iteration)
        iterations = (*self.iterations[:count], msg.iteration)
        returns = (*self.returns[:count], msg.mean_return)
        if count < MAX_POINTS:
            return LearningCurve(iterations, returns)
        first = 1 - len(iterations) % 2
        return LearningCurve(iterations[first::2], returns[first::2])


class RunReports:
    """
    The newest message of each kind in one run; None where there was none.

    Parameters
    ----------
    history: whether all results of iterations and episodes are stored too.

    Attributes
    ----------
    description, learner: of the world, and of the learner.
    observation, action, episode, progress: the newest ones.
    curve: the learning curve.
    trust, policy, values, mentor_policy: arrays over all states.
    advice: the newest recommended action by state.
    visited: the states of all observations.
    progress_by_iteration, episodes: all results, with `history`; episodes by (run, episode).

    """

    def __init__(self, history: bool = False) -> None:
        self.description: WorldDescription | None = None
        self.learner: LearnerDescription | None = None
        self.observation: StateReward | None = None
        self.action: Action | None = None
        self.episode: Episode | None = None
        self.progress: Progress | None = None
        self.curve = LearningCurve()
        self.trust: NDArray[Any] | None = None
        self.policy: NDArray[Any] | None = None
        self.values: NDArray[Any] | None = None
        self.mentor_policy: NDArray[Any] | None = None
        self.advice: dict[int, int] = {}
        self.visited: set[int] = set()
        self.progress_by_iteration: dict[int, Progress] = {}
        self.episodes: dict[tuple[int, int], Episode] = {}
        self._history = history

    def add(self, topic: str, msg: Any) -> None:
        """Take the next message on a topic; one that cannot be right is passed over."""
        if topic == 'state':
            self.observation = msg
            self.visited.add(msg.state)
        elif topic == 'action':
            self.action = msg
        elif topic == 'recommendation':
            self.advice[msg.state] = msg.action
        elif topic == 'progress':
            if is_possible_progress(msg):
                self.progress, self.curve = msg, self.curve.extended(msg)
                if self._history:
                    self.progress_by_iteration[msg.iteration] = msg
        elif topic == 'episode':
            self.episode = msg
            if self._history:
                self.episodes[msg.run, msg.episode] = msg
        elif topic in STATE_MAPS:
            field, dtype = STATE_MAPS[topic]
            setattr(self, topic, np.array(getattr(msg, field), dtype=dtype))
        elif topic == 'world':
            self.description = msg
        elif topic == 'method':
            self.learner = msg

    def validate_maps(self, world: World) -> list[Rejected]:
        """Remove the arrays that cannot be of this world; return why."""
        problems = []
        for topic in STATE_MAPS:
            array = getattr(self, topic)
            if array is None:
                continue
            try:
                setattr(self, topic, _validated(topic, array, world))
            except ValueError as error:
                setattr(self, topic, None)
                problems.append(Rejected(f'{topic} of another shape or content', str(error)))
        return problems


def is_possible_progress(msg: Progress) -> bool:
    """Tell whether the numbers of a `Progress` are what the message promises."""
    return (isfinite(msg.mean_return) and 0.0 <= msg.temperature < float('inf')
            and (msg.confidence != msg.confidence or 0.0 <= msg.confidence <= 1.0)
            and msg.episodes > 0 and msg.finished == (msg.iteration == msg.iterations))


def _validated(topic: str, array: NDArray[Any], world: World) -> NDArray[Any]:
    if len(array) != world.n_states:
        raise ValueError(f'{topic} must have the {world.n_states} states of the world, got '
                         f'{len(array)}')
    if topic == 'trust':
        wrong = ~((array >= 0.0) & (array <= 1.0))  # nan, too, is no confidence
        if wrong.any():
            raise ValueError(f'{topic} must lie in [0, 1], got {array[wrong][0]}')
    elif topic == 'values':
        wrong = world.free & ~np.isfinite(array)
        if wrong.any():
            raise ValueError(f'{topic} must be finite numbers, got {array[wrong][0]}')
    else:
        try:
            return validate_policy(array, world, clear_not_free=True)
        except PolicyError as error:
            raise ValueError(f'{topic}: {error}') from None
    return array


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
    changed: topics of this run with a new message; whoever shows them clears the set.

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
        self.changed.add(topic)
        if topic in STATE_MAPS and self.world is not None:
            return tuple(self.reports.validate_maps(self.world))
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
