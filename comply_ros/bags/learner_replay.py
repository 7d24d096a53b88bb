# SPDX-License-Identifier: Apache-2.0
"""A fresh learner that receives what a recorded one received, and must publish the same."""

from collections.abc import Sequence
from dataclasses import asdict
from functools import cached_property
import json
from typing import Any

from comply_ros.bags.bag_message import BagError
from comply_ros.bags.message_decoder import world_from_description
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.mentor.several_mentors import can_be_mentors
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor_topics import topic_and_mentor
from comply_ros.protocol.messages import (
    Action,
    ANYONE,
    INITIAL_LEARNING,
    LearnerDescription,
    Progress,
    Recommendation,
    StateReward,
    step_id,
    WorldDescription,
)
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World

FIRST_STEP = (1, 0)  # step id with which a run starts
ATTEMPTS = 3  # to deliver an observation: the learner takes one after a gap when it is repeated
RENAMED_FIELDS = {'curiosity': 'exploration_probability'}  # of `LearnerConfig`, in older bags


class ReplayDifference(Exception):
    """A recorded message that a fresh learner does not publish; the text names it."""


class MissingMessage(ReplayDifference):
    """A message that is not in the bag, so that nothing after it can be verified."""


class RecordedRun:
    """
    The messages of one run that may still be needed.

    description: of its world, None before it.
    observations: by step id.
    advice: actions by (name of the mentor, state), from its recommendations and policies, the
        newest last.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        self.description: WorldDescription | None = None
        self.observations: dict[tuple[int, int], StateReward] = {}
        self.advice: dict[tuple[str, int], list[int]] = {}

    def add(self, full_name: str, msg: Any) -> None:
        """Store a message. full_name: of its topic, as `name_of_mentor` makes it."""
        topic, name = topic_and_mentor(full_name)
        if topic == 'world':
            self.description = msg
        elif topic == 'state':
            self.observations.setdefault(step_id(msg), msg)
        elif topic in ('recommendation', 'mentor_policy'):
            is_policy = topic == 'mentor_policy'
            if name and not is_policy and msg.mentor != name:
                return  # which a learner rejects
            advice = dict(enumerate(msg.action)) if is_policy else {msg.state: msg.action}
            for state, action in advice.items():
                older = [each for each in self.recommended(name, state) if each != action]
                self.advice[name, state] = [*older, action]

    def recommended(self, name: str, state: int) -> list[int]:
        """Return what a mentor recommended in a state, the newest last."""
        return self.advice.get((name, state), [])

    def discard(self, last: tuple[int, int]) -> None:
        """Discard the observations up to a step id."""
        for key in [key for key in self.observations if key <= last]:
            del self.observations[key]

    @cached_property
    def world(self) -> World:
        """The world; raises MissingMessage, or BagError for one that is invalid."""
        if self.description is None:
            raise MissingMessage(f'the world of run {self.number} is not in the bag')
        return world_from_description(self.description)


class LearnerReplay:
    """
    One fresh learner, compared with a recorded one.

    description: the first one of the recorded learner; BagError if it has no valid settings.
    runs: by number; the caller adds messages, this class discards those that are done.

    Attributes
    ----------
    learner: the fresh `Learner`.
    matching: number of its actions that are as recorded.
    inferred: number of its actions that are not in the bag, but the observations after them are.
    unadvised: number of matching actions whose advice is not in the bag.
    digests: number of matching digests; `digest` is the last one.
    first, last: first and last observation with a matching or inferred action, None before.
    progress: what the fresh learner has published, by run, iteration and name of the mentor; of
        one without a name beside others, there is that of all mentors too.

    """

    def __init__(self, description: LearnerDescription, runs: dict[int, RecordedRun]) -> None:
        self.description, self._runs = description, runs
        self.learner = Learner(config_from_description(description), description.seed, False,
                               description.learner, mentors=tuple(description.mentors))
        self.matching, self.inferred, self.unadvised, self.digests = 0, 0, 0, 0
        self.digest: str | None = None
        self.first: StateReward | None = None
        self.last: StateReward | None = None
        self.progress: dict[tuple[int, int, str], list[Progress]] = {}
        self._later: list[LearnerDescription] = []

    def expect(self, description: LearnerDescription) -> None:
        """Store a later description, to be compared after the same number of observations."""
        count = description.observation_count
        if count < self.learner.step_count and description.digest:
            raise MissingMessage(f'the digest after {count} observations is in the '
                                 f'bag only after {self.learner.step_count} of them')
        self._later.append(description)

    def is_recorded_from_start(self, action: Action) -> bool:
        """Whether the bag has all observations before the first action that it has."""
        return (self.last is not None or not action.observation_count
                or FIRST_STEP in self._runs[action.run].observations)

    def check(self, recorded: Action) -> None:
        """Let the learner act on the same observation; raises ReplayDifference. Skips a repeat."""
        step = step_id(recorded)
        if self.last and self.last.run == recorded.run and step <= step_id(self.last):
            return
        while self.learner.step_count < recorded.observation_count:
            self._infer(*self._next(recorded.run))
            self.inferred += 1
        count = recorded.observation_count
        if self.learner.step_count != count:
            raise ReplayDifference(f'topic action, {place(recorded)}: recorded after '
                                   f'{count} observations; a fresh learner has answered '
                                   f'{self.learner.step_count}')
        observation = self._observation(recorded.run, step)
        recorded = recorded._replace(all_advice=tuple(recorded.all_advice))
        advice = recorded.all_advice or (recorded.advice,)
        action = self._deliver(observation, advice)
        if repr(action) != repr(recorded):
            raise ReplayDifference(f'topic action, {place(recorded)}: recorded {_text(recorded)}; '
                                   f'a fresh learner publishes {_text(action)}')
        self._check_advice(recorded, observation.state, advice)
        self.matching += 1
        self._advance(observation)

    def _check_advice(self, recorded: Action, state: int, advice: Sequence[int]) -> None:
        """Count an action whose advice is not in the bag; raises ReplayDifference for another."""
        missing = False
        for name, action in zip(self.learner.mentors, advice):
            recommended = self._runs[recorded.run].recommended(name, state)
            if action == NO_ACTION or action in recommended:
                continue
            missing = True
            if recommended:
                of = f' of mentor {name}' if name else ''
                raise ReplayDifference(f'topic action, {place(recorded)}: recorded advice '
                                       f'{action}{of} in state {state}, and the bag has no such '
                                       'recommendation')
        self.unadvised += missing

    def finish(self) -> None:
        """Deliver the last observation, which has no action if it ended the training."""
        due = any(each.observation_count == self.learner.step_count + 1 for each in self._later)
        if due and self.last is not None:
            self._infer(*self._next(self.last.run))

    def _next(self, run: int) -> tuple[int, tuple[int, int]]:
        """Return run and step id of the next observation: of the last run, or the first here."""
        if self.last is None:
            return run, FIRST_STEP
        episode, step = step_id(self.last)
        ended = self.last.terminated or self.last.truncated
        following = (episode + 1, 0) if ended else (episode, step + 1)
        if run != self.last.run and following not in self._runs[self.last.run].observations:
            return run, FIRST_STEP
        return self.last.run, following

    def _infer(self, run: int, step: tuple[int, int]) -> None:
        """Deliver an observation whose action is not in the bag."""
        observation = self._observation(run, step)
        newest = [self._runs[run].recommended(name, observation.state)[-1:]
                  for name in self.learner.expected_mentors]
        self._deliver(observation, [action for each in newest for action in each or [NO_ACTION]])
        self._advance(observation)

    def _observation(self, run: int, step: tuple[int, int]) -> StateReward:
        observation = self._runs[run].observations.get(step)
        if observation is None:
            raise MissingMessage(f'the observation of run {run}, episode {step[0]}, step {step[1]}'
                                 ', is not in the bag')
        return observation._replace(learner=ANYONE)

    def _deliver(self, observation: StateReward, advice: Sequence[int]) -> Action | None:
        """Return the action of the learner, None if it publishes none. advice: of each mentor."""
        if self.learner.tracker.run != observation.run:
            run = self._runs[observation.run]
            self.learner.tracker.follow(run.description, run.world.source)
        answered, outputs = self.learner.step_count, ()
        for _ in range(ATTEMPTS):
            outputs = self.learner.observe(observation)
            for receive, action in zip(self.learner.receivers, advice):
                if self.learner.waiting:
                    outputs += receive(Recommendation(*observation[:4], action))
            if self.learner.step_count > answered:
                break
            self.learner.tick()
        for msg in outputs:
            if isinstance(msg, Progress):
                self.progress.setdefault((msg.run, msg.iteration, msg.mentor), []).append(msg)
        return next((msg for msg in outputs if isinstance(msg, Action)), None)

    def _advance(self, observation: StateReward) -> None:
        """Go on after an observation; apply and compare the descriptions that belong here."""
        self.first, self.last = self.first or observation, observation
        self.learner.journal_entries.clear()
        self._runs[observation.run].discard(step_id(observation))
        count = self.learner.step_count
        due = [each for each in self._later if each.observation_count == count]
        self._later = [each for each in self._later if each.observation_count > count]
        for description in due:
            config, current = config_from_description(description), asdict(self.learner.config)
            changes = {name: value for name, value in asdict(config).items()
                       if value != current[name]}
            if changes:  # before the digest, which includes them
                self.learner.change(changes)
            for name in description.mentors:
                if name not in self.learner.expected_mentors:
                    self.learner.join(name)
            if description.digest:
                self.digest = self.learner.state.digest()
                if self.digest != description.digest:
                    raise ReplayDifference(f'topic method, after {count} observations:'
                                           f' recorded digest {description.digest}; a fresh '
                                           f'learner has {self.digest}')
                self.digests += 1


def config_from_description(description: LearnerDescription) -> LearnerConfig:
    """`LearnerConfig` of a description, of this or an older version; raises BagError."""
    if not can_be_mentors(description.mentors):
        raise BagError(f'the mentors of learner {description.learner} must have names that they '
                       f'can have, got {description.mentors!r}')
    try:
        settings = json.loads(description.settings)
        return LearnerConfig(**{RENAMED_FIELDS.get(name, name): value
                                for name, value in settings.items() if name != INITIAL_LEARNING})
    except (ValueError, TypeError, AttributeError) as error:
        raise BagError(f'the settings of learner {description.learner} must be fields of a method:'
                       f' {error}') from None


def begins_with_learning(description: LearnerDescription) -> bool:
    """Tell whether a learner began with what another one had learned."""
    try:
        return INITIAL_LEARNING in json.loads(description.settings)
    except (ValueError, TypeError):
        return False


def place(msg: Action | StateReward) -> str:
    """Text of the run and step id of a message."""
    return f'run {msg.run}, episode {msg.episode}, step {msg.step}'


def _text(msg: Action | None) -> str:
    """Text of the fields of an action that a learner decides."""
    return 'nothing' if msg is None else (
        f'action {msg.action}, advice {msg.advice}, followed {msg.followed}, '
        f'confidence {msg.confidence!r}')
