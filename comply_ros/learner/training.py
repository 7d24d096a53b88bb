# SPDX-License-Identifier: Apache-2.0
"""Training in one process: world, mentor and learner as one compiled loop over many steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from comply_ros.learner.agent import Agent, count_confidences, IterationResult, no_advice
from comply_ros.learner.choose_and_learn import choose_and_learn
from comply_ros.learner.learner_config import KernelConfig, LearnerConfig, NO_TRUST
from comply_ros.learner.learner_state import Array, LearnerState, ONE_MENTOR
from comply_ros.learner.learning_result import Learned
from comply_ros.learner.mentor_of_episode import record_return
from comply_ros.learner.mentor_records import count_fruitless_episode
from comply_ros.learner.usual_outcome_model import finish_episode
from comply_ros.mentor.advice_budget import AdviceBudget, advise, record_action
from comply_ros.numerics.jit import kernel, specialized
from comply_ros.numerics.rng import random_streams, UniformRows
from comply_ros.world.grid import MapError, NO_ACTION
from comply_ros.world.mdp import next_state, World, WorldArrays


class Position(NamedTuple):
    """
    Where a training is in its iteration.

    Attributes
    ----------
    episode: of the iteration, from 0.
    step: of the episode, -1 before its first state.
    s, a: the last state, and the action taken there.

    """

    episode: int
    step: int
    s: int
    a: int


Mentors = Mapping[str, AdviceBudget]  # by their names


class MentorArrays(NamedTuple):
    """The arrays of an `AdviceBudget`."""

    policy: Array
    important: Array
    advised: Array
    remaining: Array
    last_actions: Array


class Training:
    """
    An agent, its world and its mentor in one process: the bits of the three nodes.

    Parameters
    ----------
    world: the world.
    advice: `advice[s]`, the mentor's action, -1 for none; or an `AdviceBudget`; or a table of
        the `AdviceBudget` of each mentor by its name.
    config: the settings of the learner.
    seed: of the random numbers of world and learner.
    initial: values and beliefs to begin with, see `Agent`.

    Raises
    ------
    MapError: for a world without a model.
    LearningError: as `Agent.start`.

    Attributes
    ----------
    agent: the agent, with what it has learned.
    advice: `advice[s]` that it received, the newest one; -1 where none. Of several mentors in
        rows, `advice[m * n_states + s]`.
    returns, lengths: of the episodes of the last iteration.

    """

    def __init__(self, world: World, advice: ArrayLike | AdviceBudget | Mentors,
                 config: LearnerConfig, seed: int, initial: Learned | None = None) -> None:
        if world.model == 'none':
            raise MapError('a training in one process needs a world of which is known what every '
                           'action leads to, got one without a model')
        mentors = mentors_by_name(world, advice)
        self.agent = Agent(config, seed, initial, tuple(mentors))
        self.agent.start(world)
        self.advice = self.agent.earlier_advice.copy()
        self._moves = UniformRows(random_streams(seed)[0], 1)
        if not config.needs_mentor():
            mentors = {name: AdviceBudget(world, no_advice(world)) for name in mentors}
        self._mentors = tuple(MentorArrays(*mentor.arrays()) for mentor in mentors.values())
        self._heard = np.full(len(mentors), NO_ACTION), np.full(len(mentors), NO_ACTION)
        self._world = world.arrays()
        self.returns, self.lengths = np.zeros(0), np.zeros(0, dtype=np.int64)
        self._compiled_play = specialized(play, *self._arguments(
            False, Position(0, -1, 0, 0), self._no_confidences()))

    @property
    def state(self) -> LearnerState:
        """What the agent has learned."""
        return self.agent.state

    @property
    def iterations_done(self) -> int:
        """Number of iterations so far."""
        return self.agent.iterations_done

    def learned(self) -> Learned:
        """Return what was learned so far; its arrays are not copied."""
        return self.agent.learned(self.advice)

    def iterate(self) -> IterationResult:
        """Play one mini-batch of episodes and return its result."""
        episodes = self.agent.config.episodes
        self.returns, self.lengths = np.zeros(episodes), np.zeros(episodes, dtype=np.int64)
        confidences = self._no_confidences()
        position = Position(0, -1, 0, 0)
        while position.episode < episodes:
            position = self._play(self.agent.learns, position, confidences)
        steps = int(self.lengths.sum())
        self.agent.steps += steps
        return self.agent.finish_iteration(self.returns.tolist(), confidences.tolist(), steps)

    def _no_confidences(self) -> Array:
        return np.array(self.agent.no_confidences())

    def _play(self, learns: bool, position: Position, confidences: Array) -> Position:
        """Play as far as the random numbers of a block reach, and return the new position."""
        count, position = self._compiled_play(*self._arguments(learns, position, confidences))
        self._moves.use(count)
        self.agent.draws.use(count)
        return position

    def _arguments(self, learns: bool, position: Position, confidences: Array) -> tuple[Any, ...]:
        return (learns, self._world, self._mentors, self.agent.kernel_config, self.agent.state,
                position, *self._heard, self.returns, self.lengths, confidences,
                self._moves.block(), self.agent.draws.block(), self.agent.policy, self.advice)


def mentors_by_name(world: World, advice: ArrayLike | AdviceBudget | Mentors) -> Mentors:
    """Return the mentors by name; the only one of `advice[s]` or an `AdviceBudget` has none."""
    if isinstance(advice, Mapping):
        return advice
    mentor = advice if isinstance(advice, AdviceBudget) else AdviceBudget(world, advice)
    return {ONE_MENTOR[0]: mentor}


@kernel
def play(learns: bool, world: WorldArrays, mentors: tuple[MentorArrays, ...],
         config: KernelConfig, state: LearnerState, position: Position, last_advice: Array,
         advice: Array, returns: Array, lengths: Array, confidences: Array, moves: Array,
         decisions: Array, policy: Array, received: Array) -> tuple[int, Position]:
    """
    Change the arrays; return the number of states visited and the new position.

    Plays until the iteration has all its episodes or the random numbers are used up.

    Parameters
    ----------
    last_advice, advice: `advice[m]` in the last state and in the present one, -1 for none.
    returns, lengths: of the episodes of the iteration.
    confidences: as `Agent.finish_iteration` takes them.
    moves, decisions: uniforms of the world and of the learner, a row for each state.
    policy: `policy[s]` of a learner that does not learn.
    received: `advice[m * n_states + s]` that the learner received, the newest one.

    """
    episode, step, s, a = position.episode, position.step, position.s, position.a
    count, most = 0, min(len(moves), len(decisions))
    while count < most and episode < len(returns):
        r, s2, done, over = next_state(step, s, a, moves[count, 0], world)
        for m in range(len(config.mentors)):
            advice[m] = NO_ACTION
            if not done and config.learns:
                advice[m] = ask(s2, mentors[m])
                if config.trust != NO_TRUST:
                    received[m * len(state.departures) + s2] = advice[m]
        a2, p, trusted = choose_and_learn(
            learns, s, a if step >= 0 else NO_ACTION, last_advice, r, s2, step + 1, done, advice,
            decisions[count, 0], decisions[count, 1], config, state, policy)
        for m in range(len(config.mentors)):
            last_advice[m] = advice[m]
            if not over:  # the last choice of a truncated episode is never published
                record_action(s2, a2, mentors[m].last_actions)
        if trusted >= 0:
            count_confidences(p, advice, confidences, config, state)
        if step >= 0:
            returns[episode] += r
        count += 1
        step, s, a = step + 1, s2, a2
        if over:
            if learns and len(config.has_model) > 0:
                count_fruitless_episode(config, state)
            finish_episode(config, state)
            if learns and len(config.has_bandit) > 0:
                record_return(returns[episode], config, state)
            lengths[episode] = step
            episode, step = episode + 1, -1
    return count, Position(episode, step, s, a)


@kernel
def ask(s: int, mentor: MentorArrays) -> int:
    """Return the recommendation of a mentor in state s, -1 for none."""
    return advise(s, mentor.policy, mentor.important, mentor.advised, mentor.remaining,
                  mentor.last_actions)
