# SPDX-License-Identifier: Apache-2.0
"""The newest messages of each kind in one run, of the learner and of each of its mentors."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.mentor.several_mentors import can_be_mentors, MOST_MENTORS
from comply_ros.protocol.iteration_curve import IterationCurve
from comply_ros.protocol.mentor_topics import topic_and_mentor
from comply_ros.protocol.messages import (
    Action,
    Episode,
    LearnerDescription,
    Progress,
    Rejected,
    StateReward,
    WorldDescription,
)
from comply_ros.protocol.state_maps import (
    MentorReports,
    NOTHING,
    OF_MENTOR,
    STATE_MAPS,
    validated_map,
)
from comply_ros.world.mdp import World


class RunReports:
    """
    The newest message of each kind in one run; None where there was none.

    Parameters
    ----------
    history: whether all results of iterations and episodes are stored too.

    Attributes
    ----------
    description, learner: of the world, and of the learner.
    observation, action, episode, progress: the newest ones; `progress` is for all mentors.
    curve: the learning curve.
    overall_confidence: in the advice that counted, in each iteration; nan where there was none.
    policy, values: arrays over all states.
    mentors: what is known of each mentor, by name; '' for one without a name.
    advice: of each mentor, the newest recommended action by state.
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
        self.curve = self.overall_confidence = IterationCurve()
        self.policy: NDArray[Any] | None = None
        self.values: NDArray[Any] | None = None
        self.mentors: dict[str, MentorReports] = {}
        self.advice: dict[str, dict[int, int]] = {}
        self.visited: set[int] = set()
        self.progress_by_iteration: dict[int, Progress] = {}
        self.episodes: dict[tuple[int, int], Episode] = {}
        self._history = history

    def mentor_names(self) -> tuple[str, ...]:
        """
        Return the names of the mentors, always the same way: there is at least one.

        First those that the learner has, in its order, then others that are known. One without a
        name, which every learner has until it finds others, is left out where it is silent.
        """
        own = self.learner.mentors if self.learner else ()
        names = (*own, *sorted(self.mentors.keys() - set(own)))
        known = [name for name in names
                 if name or len(own) > 1 and '' in own or self.of_mentor().policy is not None]
        return tuple(known) or ('',)

    def of_mentor(self, name: str = '') -> MentorReports:
        """Return what is known of a mentor."""
        return self.mentors.get(name, NOTHING)

    def confidence_in(self, name: str) -> float | None:
        """Return the confidence in a mentor in the last iteration; None without its advice."""
        several = len(self.mentor_names()) > 1
        confidence = self.of_mentor(name).confidence if several else \
            self.progress and self.progress.confidence
        return None if confidence is None or confidence != confidence else confidence

    def confidence_curve(self, name: str) -> IterationCurve:
        """
        Return the confidence in a mentor in each iteration; nan in one without its advice.

        That in the first mentor begins when it was the only one, before others joined.
        """
        own = self.of_mentor(name).curve
        if name != self.mentor_names()[0]:
            return own
        joined = [each.curve.iterations[0] for each in self.mentors.values()
                  if each.curve.iterations]
        alone = self.overall_confidence
        return (alone.before(min(joined)) if joined else alone).followed_by(own)

    def _change_mentor(self, name: str, **fields: Any) -> None:
        """Store what is known of a mentor now, if there can be one more of this name."""
        if name in self.mentors or can_be_mentors([name]) and len(self.mentors) <= MOST_MENTORS:
            self.mentors = {**self.mentors, name: self.of_mentor(name)._replace(**fields)}

    def add(self, full_name: str, msg: Any) -> None:
        """
        Take the next message on a topic; one that cannot be right is passed over.

        full_name: of the topic, as `name_of_mentor` makes it.
        """
        topic, mentor = topic_and_mentor(full_name)
        if topic == 'state':
            self.observation = msg
            self.visited.add(msg.state)
        elif topic == 'action':
            self.action = msg
        elif topic == 'recommendation':
            self.advice.setdefault(mentor, {})[msg.state] = msg.action
        elif topic == 'progress':
            if is_possible_progress(msg):
                self._add_progress(msg)
        elif topic == 'episode':
            self.episode = msg
            if self._history:
                self.episodes[msg.run, msg.episode] = msg
        elif topic in STATE_MAPS:
            field, dtype = STATE_MAPS[topic]
            self._store_map(topic, mentor_of(full_name, msg),
                            np.array(getattr(msg, field), dtype=dtype))
        elif topic == 'world':
            self.description = msg
        elif topic == 'method' and can_be_mentors(msg.mentors):
            self.learner = msg

    def _add_progress(self, msg: Progress) -> None:
        """
        Take the result of an iteration, or the confidence in one of several mentors in it.

        That in a mentor without a name follows the result, and has the same iteration.
        """
        own = self.learner.mentors if self.learner else ()
        is_unnamed = (len(own) > 1 and '' in own and self.progress is not None
                      and self.progress.iteration == msg.iteration)
        if msg.mentor or is_unnamed:
            curve = self.of_mentor(msg.mentor).curve.extended(msg.iteration, msg.confidence)
            self._change_mentor(msg.mentor, confidence=msg.confidence, curve=curve)
            return
        self.progress = msg
        self.curve = self.curve.extended(msg.iteration, msg.mean_return)
        self.overall_confidence = self.overall_confidence.extended(
            msg.iteration, msg.confidence)
        if self._history:
            self.progress_by_iteration[msg.iteration] = msg

    def validate_maps(self, world: World) -> list[Rejected]:
        """Remove the arrays that cannot be of this world; return why."""
        maps = [('policy', ''), ('values', ''),
                *((topic, name) for name in self.mentors for topic in OF_MENTOR)]
        return [problem for topic, name in maps
                for problem in self.validate_map(world, topic, name)]

    def validate_map(self, world: World, topic: str, mentor: str = '') -> list[Rejected]:
        """Remove the array of a topic, of a mentor, if it cannot be of this world; return why."""
        array = getattr(self.of_mentor(mentor), OF_MENTOR[topic]) if topic in OF_MENTOR \
            else getattr(self, topic)
        if array is None:
            return []
        problems = []
        try:
            array = validated_map(topic, mentor, array, world)
        except ValueError as error:
            array = None
            problems.append(Rejected(f'{topic} of another shape or content', str(error)))
        self._store_map(topic, mentor, array)
        return problems

    def _store_map(self, topic: str, mentor: str, array: NDArray[Any] | None) -> None:
        if topic in OF_MENTOR:
            self._change_mentor(mentor, **{OF_MENTOR[topic]: array})
        else:
            setattr(self, topic, array)


def mentor_of(topic: str, msg: Any) -> str:
    """Return the name of the mentor that a message is about: its own, or that of the topic."""
    return getattr(msg, 'mentor', '') or topic_and_mentor(topic)[1]


def is_possible_progress(msg: Progress) -> bool:
    """Tell whether the numbers of a `Progress` are what the message promises."""
    return (isfinite(msg.mean_return) and 0.0 <= msg.temperature < float('inf')
            and (msg.confidence != msg.confidence or 0.0 <= msg.confidence <= 1.0)
            and msg.episodes > 0 and msg.finished == (msg.iteration == msg.iterations))
