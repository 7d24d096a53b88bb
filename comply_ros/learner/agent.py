# SPDX-License-Identifier: Apache-2.0
"""The agent: it acts, learns from rewards, and counts its iterations; plain values in and out."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comply_ros.learner.exploration import DRAWS
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.learner_state import initial_state, LATER_ARRAYS, LearnerState
from comply_ros.learner.learning_result import begin_from, Learned, learned_by
from comply_ros.learner.learning_step import choose_and_learn
from comply_ros.learner.reconfigure import changed_state
from comply_ros.learner.update_rules import decay_schedules
from comply_ros.learner.usual_outcome import finish_episode
from comply_ros.numerics.jit import plain_view
from comply_ros.numerics.rng import random_streams, UniformRows
from comply_ros.numerics.summation import mean_in_order
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World


class IterationResult(NamedTuple):
    """
    One mini-batch of episodes.

    Attributes
    ----------
    number: from 1.
    mean_return: per episode.
    confidence: mean p over the decisions that had advice, nan without any.
    temperature: of the softmax in it.
    steps: actions taken in it.
    episodes: number of them.

    """

    number: int
    mean_return: float
    confidence: float
    temperature: float
    steps: int
    episodes: int


class Decision(NamedTuple):
    """
    What the agent does in a state.

    Attributes
    ----------
    action: -1 at a goal.
    followed: whether the advice was followed.
    confidence: the probability p with which it was, 0 without advice.
    iteration: the result of the iteration that ends here, if one does.

    """

    action: int
    followed: bool
    confidence: float
    iteration: IterationResult | None


# The attributes that `Agent.state_dict` holds besides the arrays of the state.
COUNTERS = ('iterations_done', 'steps', 'finished', '_whole_episode', '_return', '_returns',
            '_iteration_steps', '_advised', '_confidence_sum', '_last_state', '_last_action',
            '_last_advice')


class Agent:
    """
    A learner that the nodes step observation by observation, and `Training` in compiled blocks.

    Parameters
    ----------
    config: its settings.
    seed: of its decisions.
    initial: values and beliefs that it begins with, also after a reset; None for none. Its
        schedules and random numbers begin anew: this does not continue the training before.

    Attributes
    ----------
    config: as given, or as changed by `reconfigure`.
    initial: as given.
    earlier_advice: `advice[s]` received before this run, or with the initial learning; -1 where
        none.
    policy: `policy[s]` that it acts by while it does not learn.
    draws: the random numbers of its decisions, a row for each observation.
    state: what it has learned; set by `start`.
    kernel_config: the settings as kernels take them.
    steps, iterations_done: so far.
    finished: True when all iterations are done.

    """

    state: LearnerState

    def __init__(self, config: LearnerConfig, seed: int, initial: Learned | None = None) -> None:
        self.config, self.initial, self._seed = config, initial, seed
        self.draws = UniformRows(random_streams(seed)[1], DRAWS)
        self.forget_last_action()

    @property
    def learns(self) -> bool:
        """Whether it learns from the next step, and does not only measure or act."""
        return self.config.learns and self.iterations_done >= self.config.measuring_iterations

    def start(self, world: World) -> None:
        """
        Start in a world, with the initial learning or nothing; the random numbers continue.

        Raises
        ------
        LearningError: if the initial learning is of another world, or does not fit the settings.

        """
        config, initial, unknown = self.config, self.initial, no_advice(world)
        state = begin_from(initial, world, config) if initial else initial_state(world, config)
        self._world, self.earlier_advice = world, initial.advice if initial else unknown
        if initial and not config.learns:
            self._act_by(initial.policy, initial.confidence)
        else:
            self._act_by(no_advice(world), np.zeros(len(unknown)))
        self._use(state)
        self.iterations_done, self.steps, self.finished = 0, 0, False
        self._start_iteration()
        self._whole_episode, self._return = False, 0.0

    def reset(self) -> None:
        """Return to the start, with the initial learning; the random numbers start again."""
        self.draws = UniformRows(random_streams(self._seed)[1], DRAWS)
        self.start(self._world)
        self.forget_last_action()

    def forget_last_action(self) -> None:
        """Learn nothing from the next reward: the last action did not lead to it."""
        self._last_state, self._last_action, self._last_advice = 0, NO_ACTION, NO_ACTION

    def reconfigure(self, config: LearnerConfig, advice: ArrayLike) -> None:
        """
        Continue under other settings. A finished agent continues if `iterations` changed.

        advice: `advice[s]` that it received so far, on which it may act if it stops to learn.
        """
        before = self.config
        if before.learns and not config.learns:
            finish_episode(self.kernel_config, self._views)  # no later one shall change a value
            learned = self.learned(advice)
            self._act_by(learned.policy, learned.confidence)
        self.config = config
        self.finished = self.finished and config.iterations == before.iterations
        self._use(changed_state(self.state, self._world, before, config))

    def learned(self, advice: ArrayLike) -> Learned:
        """Return what was learned, as `learned_by`; advice: `advice[s]` that it received."""
        world = self._world
        received = np.array(advice, dtype=world.action_type)
        learned = learned_by(self.config, self.state, received, world)
        return learned if self.config.learns else learned._replace(
            policy=self.policy, confidence=self._confidence)

    def step(self, s: int, step: int, reward: float, terminated: bool, truncated: bool,
             advice: int) -> Decision:
        """
        Choose the action in state s, then learn from the reward of the last action.

        Parameters
        ----------
        step: of the episode; at 0 an episode starts, and the reward is 0.
        reward: of the action that led to s.
        terminated, truncated: whether the episode ends here, at a goal or at the step limit.
        advice: the mentor's action in s, -1 for none.

        """
        u_listen, u_act = self.draws.row()
        follows = step > 0 and self._last_action != NO_ACTION
        a, p = choose_and_learn(
            self.learns, self._last_state, self._last_action if follows else NO_ACTION,
            self._last_advice, reward, s, step, terminated, advice, u_listen, u_act,
            self.kernel_config, self._views, self._policy_view)
        if advice != NO_ACTION and self.config.learns and not terminated:
            self._advised += 1
            self._confidence_sum += p
        if follows:
            self._return += reward
            self._iteration_steps += 1
            self.steps += 1
        else:
            self._abandon_episode()
            self._whole_episode = step == 0
        self._last_state, self._last_action, self._last_advice = s, a, advice
        iteration = self._finish_episode() if terminated or truncated else None
        return Decision(a, u_listen < p, p, iteration)

    def finish_iteration(self, returns: list[float], advised: float, confidence_sum: float,
                         steps: int) -> IterationResult:
        """
        Change the schedules at the end of an iteration, and return its result.

        Parameters
        ----------
        returns: of its episodes.
        advised: number of its decisions with advice.
        confidence_sum: over these decisions.
        steps: taken in it.

        """
        temperature = float(self.state.temperature[0])
        mean = mean_in_order(returns)
        if self.config.learns:
            decay_schedules(mean, self.kernel_config, self.state)
        self.iterations_done += 1
        self.finished = self.iterations_done == self.config.iterations
        confidence = float(confidence_sum / advised) if advised else float('nan')
        return IterationResult(self.iterations_done, mean, confidence, temperature, steps,
                               len(returns))

    def state_dict(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Return everything needed to continue later: values for JSON, and arrays by name."""
        values = {name.lstrip('_'): getattr(self, name) for name in COUNTERS}
        arrays = self.state._asdict()
        if (self.earlier_advice != NO_ACTION).any():
            arrays['earlier_advice'] = self.earlier_advice
        if not self.config.learns:
            arrays |= {'policy': self.policy, 'policy_confidence': self._confidence}
        return {**values, 'observations': self.draws.used}, arrays

    def load_state_dict(self, values: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> None:
        """
        Continue from what `state_dict` returned in the same world.

        Raises
        ------
        ValueError: if an array has another shape than that of this world and these settings.

        """
        for name in COUNTERS:
            setattr(self, name, values[name.lstrip('_')])
        self.draws.skip_to(values['observations'])
        arrays = {**LATER_ARRAYS, **arrays}
        for name, array in self.state._asdict().items():
            saved = arrays[name]
            if saved.shape != array.shape:
                raise ValueError(f'{name} must have the shape {array.shape}, got {saved.shape}')
            array[...] = saved
        self.earlier_advice = arrays.get('earlier_advice', no_advice(self._world))
        if not self.config.learns:
            self._act_by(arrays['policy'], arrays['policy_confidence'])

    def _use(self, state: LearnerState) -> None:
        self.state, self._views = state, state.views()
        self.kernel_config = self.config.for_kernels(self._world.n_actions)

    def _act_by(self, policy: NDArray[Any], confidence: NDArray[np.float64]) -> None:
        """Act by `policy[s]`, made with this confidence, while it does not learn."""
        self.policy, self._confidence = policy, confidence
        self._policy_view = plain_view(policy)

    def _start_iteration(self) -> None:
        self._returns: list[float] = []
        self._advised, self._confidence_sum, self._iteration_steps = 0, 0.0, 0

    def _abandon_episode(self) -> None:
        """End what led here; unless this is the start of an episode, it does not count."""
        finish_episode(self.kernel_config, self._views)
        self._whole_episode, self._return = False, 0.0

    def _finish_episode(self) -> IterationResult | None:
        finish_episode(self.kernel_config, self._views)
        if self._whole_episode:
            self._returns.append(self._return)
        if len(self._returns) < self.config.episodes:
            return None
        result = self.finish_iteration(self._returns, self._advised, self._confidence_sum,
                                       self._iteration_steps)
        self._start_iteration()
        return result


def no_advice(world: World) -> NDArray[Any]:
    """Return `advice[s]` of nobody: -1 in every state."""
    return np.full(world.n_states, NO_ACTION, dtype=world.action_type)
