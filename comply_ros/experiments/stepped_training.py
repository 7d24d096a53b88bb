# SPDX-License-Identifier: Apache-2.0
"""Training in a world without a model: its environment is stepped, in a plain loop."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import closing, contextmanager

from comply_ros.learner.agent import Agent, IterationResult
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.learner_state import LearnerState
from comply_ros.learner.learning_result import Learned
from comply_ros.learner.step_kernels import compiled_kernels
from comply_ros.learner.training import Mentors, mentors_by_name, Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.protocol.world_moves import Moves
from comply_ros.storage.gymnasium_world import moves_of_map
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World


class SteppedTraining:
    """
    An agent and its mentor in one process with whatever moves their world: the bits of the nodes.

    Parameters
    ----------
    world: the world.
    moves: how it moves.
    mentors: what recommends, by the names of the mentors; or the only one.
    config: the settings of the learner.
    seed: of the random numbers of the learner.
    initial: values and beliefs to begin with, see `Agent`.

    Raises
    ------
    LearningError: as `Agent.start`.

    Attributes
    ----------
    agent: the agent, with what it has learned.
    advice: `advice[s]` that it received, the newest one; -1 where none. Of several mentors in
        rows, `advice[m * n_states + s]`.

    """

    def __init__(self, world: World, moves: Moves, mentors: AdviceBudget | Mentors,
                 config: LearnerConfig, seed: int, initial: Learned | None = None) -> None:
        named = mentors_by_name(world, mentors)
        self.agent = Agent(config, seed, initial, tuple(named))
        self.agent.start(world)
        if self.agent.step_types:
            self.agent.use_kernels(compiled_kernels(self.agent.kernel_config, self.agent.state))
        self.advice = self.agent.earlier_advice.copy()
        self._moves, self._mentors, self._episode = moves, tuple(named.values()), 0
        self._silence = len(named) * (NO_ACTION,)

    @property
    def state(self) -> LearnerState:
        """What the agent has learned."""
        return self.agent.state

    def learned(self) -> Learned:
        """Return what was learned so far; its arrays are not copied."""
        return self.agent.learned(self.advice)

    def iterate(self) -> IterationResult:
        """Play one mini-batch of episodes and return its result."""
        result = None
        while result is None:
            result = self._play_episode()
        return result

    def _play_episode(self) -> IterationResult | None:
        """Play an episode; return the result of the iteration if that ends with it."""
        self._episode += 1
        step, s = 0, self._moves.start(self._episode)
        reward, terminated, truncated = 0.0, False, False
        while True:
            advice = self._silence if terminated else self._recommend(s)
            decision = self.agent.step(s, step, reward, terminated, truncated, advice)
            if terminated or truncated:
                return decision.iteration
            for mentor in self._mentors:
                mentor.record_action(s, decision.action)
            reward, s, terminated, truncated = self._moves.move(step, s, decision.action)
            step += 1

    def _recommend(self, s: int) -> tuple[int, ...]:
        """Return the recommendation of each mentor in state s, -1 for none."""
        if not self.agent.config.needs_mentor():
            return self._silence
        advice = tuple(mentor.advise(s) for mentor in self._mentors)
        self.advice.reshape(len(advice), -1)[:, s] = advice
        return advice


@contextmanager
def training_in(world: World, map_name: str, mentors: AdviceBudget | Mentors,
                config: LearnerConfig, seed: int, initial: Learned | None = None,
                ) -> Generator[Training | SteppedTraining]:
    """
    Give a training in a world: compiled where it has a model, else of its environment.

    map_name: of the world; without a model, a map `gym:NAME`.

    Raises
    ------
    MapError: for another map without a model.

    """
    if world.model != 'none':
        yield Training(world, mentors, config, seed, initial)
        return
    with closing(moves_of_map(map_name, seed)) as moves:
        yield SteppedTraining(world, moves, mentors, config, seed, initial)
