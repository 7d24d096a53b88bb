# SPDX-License-Identifier: Apache-2.0
"""The check of a whole bag: each recorded learner against a fresh one."""

from collections import deque
from typing import Any

from comply_ros.bags.learner_replay import (
    begins_with_learning,
    LearnerReplay,
    place,
    RecordedRun,
    ReplayDifference,
)
from comply_ros.protocol.messages import Action, LearnerDescription, Progress, step_id
from comply_ros.world.grid import NO_ACTION

READ_AHEAD = 1000  # messages: those of two topics can be recorded in another order


class UnverifiableLearner:
    """
    A learner of unknown initial state: its actions can only be checked to be possible.

    reason: why it is unknown.
    possible: number of its actions that fit their observations.
    """

    def __init__(self, number: int, reason: str, runs: dict[int, RecordedRun]) -> None:
        self.number, self.reason, self.possible, self._runs = number, reason, 0, runs

    def check(self, recorded: Action) -> None:
        """Compare an action with its observation, if it is there; raises ReplayDifference."""
        run = self._runs[recorded.run]
        observation = run.observations.get(step_id(recorded))
        if observation is None:
            return
        ends = observation.terminated or observation.truncated
        state, action, available = observation.state, recorded.action, run.world.available
        problem = None
        if state >= len(available):
            problem = f'state {state}, which the world does not have'
        elif ends != (action == NO_ACTION):
            problem = f'action {action} where the episode {"ends" if ends else "goes on"}'
        elif not ends and not (0 <= action < run.world.n_actions and available[state, action]):
            problem = f'action {action}, which state {state} does not have'
        elif recorded.followed and action != recorded.advice:
            problem = f'action {action} marked as following advice {recorded.advice}'
        if problem:
            raise ReplayDifference(f'topic action, {place(recorded)}: recorded {problem}')
        self.possible += 1
        run.discard(step_id(recorded))


class ReplayCheck:
    """
    Compares each learner of a bag with a fresh one.

    replays: of each learner that was recorded from its start.
    unverifiable: each other learner, by number.
    """

    def __init__(self) -> None:
        self.replays: list[LearnerReplay] = []
        self.unverifiable: dict[int, UnverifiableLearner] = {}
        self._runs: dict[int, RecordedRun] = {}
        self._current: dict[int, LearnerReplay] = {}
        self._described: set[int] = set()  # numbers of learners that have published on `method`
        self._taught: set[int] = set()  # numbers of learners that began with a learning
        self._waiting: deque[tuple[str, Any]] = deque()
        self._progress: list[Progress] = []

    def add(self, topic: str, msg: Any) -> None:
        """Take the next message of the bag; raises ReplayDifference."""
        self._runs.setdefault(msg.run, RecordedRun(msg.run)).add(topic, msg)
        if topic == 'method':
            self._described.add(msg.learner)
        if topic == 'progress':
            self._progress.append(msg)
        elif topic == 'method' and msg.observation_count and msg.learner in self._current:
            self._current[msg.learner].expect(msg)
        self._waiting.append((topic, msg))
        if len(self._waiting) > READ_AHEAD:
            self._check_next()

    def finish(self) -> None:
        """Check what is left after the last message; raises ReplayDifference."""
        while self._waiting:
            self._check_next()
        for number in self.unverifiable.keys() - self._described:
            self.unverifiable[number].reason = 'has published nothing on the topic method'
        for replay in self.replays:
            replay.finish()
        for recorded in self._progress:
            key = recorded.run, recorded.iteration, recorded.mentor
            fresh = [msg for replay in self.replays for msg in replay.progress.get(key, ())]
            if fresh and repr(recorded) not in map(repr, fresh):
                of = f', mentor {recorded.mentor}' if recorded.mentor else ''
                raise ReplayDifference(f'topic progress, run {key[0]}, iteration {key[1]}{of}: '
                                       f'recorded {recorded}; a fresh learner publishes '
                                       f'{fresh[-1]}')

    def _check_next(self) -> None:
        topic, msg = self._waiting.popleft()
        if topic == 'method' and not msg.observation_count:
            self._start(msg)
        elif topic == 'action':
            self._find(msg).check(msg)

    def _find(self, action: Action) -> LearnerReplay | UnverifiableLearner:
        """Return what checks the actions of this learner."""
        number = action.learner
        if number not in self._current and number not in self.unverifiable:
            for topic, msg in self._waiting:  # its description can be recorded a little later
                if topic == 'method' and msg.learner == number and not msg.observation_count:
                    self._waiting.remove((topic, msg))
                    self._start(msg)
                    break
        replay = self._current.get(number)
        if replay and replay.is_recorded_from_start(action):
            return replay
        if replay:
            self.replays.remove(self._current.pop(number))
        reason = 'began with initial_learning, which is not in the bag' \
            if number in self._taught else \
            f'was recorded from {place(action)} on, not from its start'
        return self.unverifiable.setdefault(
            number, UnverifiableLearner(number, reason, self._runs))

    def _start(self, description: LearnerDescription) -> None:
        """
        Start the replay of a learner; one that has not acted yet only found another world.

        What a learner began with is not in the bag, so one with an initial learning has none.
        """
        number = description.learner
        if begins_with_learning(description):
            self._taught.add(number)
            return
        earlier = self._current.get(number)
        if earlier and earlier.last is None:
            self.replays.remove(earlier)
        replay = self._current[number] = LearnerReplay(description, self._runs)
        self.replays.append(replay)
        for topic, msg in self._waiting:
            if topic == 'method' and msg.learner == number and msg.observation_count:
                replay.expect(msg)
