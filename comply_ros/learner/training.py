# SPDX-License-Identifier: Apache-2.0
"""Training in one process: world, mentor and learner as one compiled loop over many steps."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from comply_ros.learner.agent import Agent, IterationResult
from comply_ros.learner.learner_config import KernelConfig, LearnerConfig, NO_TRUST
from comply_ros.learner.learner_state import Array, LearnerState
from comply_ros.learner.learning_result import Learned
from comply_ros.learner.learning_step import choose_and_learn
from comply_ros.learner.usual_outcome import finish_episode
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
    s, a, advice: the last state, the action taken there, and the mentor's advice.

    """

    episode: int
    step: int
    s: int
    a: int
    advice: int


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
    advice: `advice[s]`, the mentor's action, -1 for none; or an `AdviceBudget`.
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
    advice: `advice[s]` that it received, the newest one; -1 where none.
    returns, lengths: of the episodes of the last iteration.

    """

    def __init__(self, world: World, advice: ArrayLike | AdviceBudget, config: LearnerConfig,
                 seed: int, initial: Learned | None = None) -> None:
        if world.model == 'none':
            raise MapError('a training in one process needs a world of which is known what every '
                           'action leads to, got one without a model')
        self.agent = Agent(config, seed, initial)
        self.agent.start(world)
        self.advice = self.agent.earlier_advice.copy()
        self._moves = UniformRows(random_streams(seed)[0], 1)
        if not config.needs_mentor():
            advice = np.full(world.n_states, NO_ACTION)
        mentor = advice if isinstance(advice, AdviceBudget) else AdviceBudget(world, advice)
        self._mentor = MentorArrays(*mentor.arrays())
        self._world = world.arrays()
        self.returns, self.lengths = np.zeros(0), np.zeros(0, dtype=np.int64)
        self._compiled_play = specialized(play, *self._arguments(
            False, Position(0, -1, 0, 0, NO_ACTION), np.zeros(2)))

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
        confidences = np.zeros(2)
        position = Position(0, -1, 0, 0, NO_ACTION)
        while position.episode < episodes:
            position = self._play(self.agent.learns, position, confidences)
        steps = int(self.lengths.sum())
        self.agent.steps += steps
        return self.agent.finish_iteration(self.returns.tolist(), confidences[0], confidences[1],
                                           steps)

    def _play(self, learns: bool, position: Position, confidences: Array) -> Position:
        """Play as far as the random numbers of a block reach, and return the new position."""
        count, position = self._compiled_play(*self._arguments(learns, position, confidences))
        self._moves.use(count)
        self.agent.draws.use(count)
        return position

    def _arguments(self, learns: bool, position: Position, confidences: Array) -> tuple[Any, ...]:
        return (learns, self._world, self._mentor, self.agent.kernel_config, self.agent.state,
                position, self.returns, self.lengths, confidences, self._moves.block(),
                self.agent.draws.block(), self.agent.policy, self.advice)


@kernel
def play(learns: bool, world: WorldArrays, mentor: MentorArrays, config: KernelConfig,
         state: LearnerState, position: Position, returns: Array, lengths: Array,
         confidences: Array, moves: Array, decisions: Array, policy: Array,
         received: Array) -> tuple[int, Position]:
    """
    Change the arrays; return the number of states visited and the new position.

    Plays until the iteration has all its episodes or the random numbers are used up.

    Parameters
    ----------
    returns, lengths: of the episodes of the iteration.
    confidences: number of decisions with advice, and the sum of their confidences.
    moves, decisions: uniforms of the world and of the learner, a row for each state.
    policy: `policy[s]` of a learner that does not learn.
    received: `advice[s]` that the learner received, the newest one.

    """
    episode, step, s, a, advice = (
        position.episode, position.step, position.s, position.a, position.advice)
    count, most = 0, min(len(moves), len(decisions))
    while count < most and episode < len(returns):
        r, s2, done, over = next_state(step, s, a, moves[count, 0], world)
        advice2 = NO_ACTION
        if not done and config.learns:
            advice2 = advise(s2, mentor.policy, mentor.important, mentor.advised,
                             mentor.remaining, mentor.last_actions)
            if config.trust != NO_TRUST:
                received[s2] = advice2
        a2, p = choose_and_learn(
            learns, s, a if step >= 0 else NO_ACTION, advice, r, s2, step + 1, done, advice2,
            decisions[count, 0], decisions[count, 1], config, state, policy)
        if not over:  # the last choice of a truncated episode is never published
            record_action(s2, a2, mentor.last_actions)
        if advice2 != NO_ACTION:
            confidences[0] += 1.0
            confidences[1] += p
        if step >= 0:
            returns[episode] += r
        count += 1
        step, s, a, advice = step + 1, s2, a2, advice2
        if over:
            finish_episode(config, state)
            lengths[episode] = step
            episode, step = episode + 1, -1
    return count, Position(episode, step, s, a, advice)
