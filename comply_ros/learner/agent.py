# SPDX-License-Identifier: Apache-2.0
"""The agent: it acts, learns from rewards, and counts its iterations; plain values in and out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comply_ros.learner.action_choice import DRAWS
from comply_ros.learner.learner_config import KernelConfig, LearnerConfig
from comply_ros.learner.learner_state import (
    Advice,
    arranged_rows,
    arranged_state,
    Array,
    initial_state,
    LATER_ARRAYS,
    LearnerState,
    ONE_MENTOR,
)
from comply_ros.learner.learning_result import begin_from, Learned, learned_by
from comply_ros.learner.mentor_of_episode import record_return
from comply_ros.learner.mentor_records import count_fruitless_episode
from comply_ros.learner.reconfigure import changed_state
from comply_ros.learner.step_kernels import PLAIN, step_types, StepKernels
from comply_ros.learner.update_rules import decay_schedules
from comply_ros.numerics.jit import kernel, plain_fields, plain_view
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
    confidences: of several mentors, in each over the decisions that had its advice.

    """

    number: int
    mean_return: float
    confidence: float
    temperature: float
    steps: int
    episodes: int
    confidences: tuple[float, ...] = ()


class Decision(NamedTuple):
    """
    What the agent does in a state.

    Attributes
    ----------
    action: -1 at a goal.
    followed: whether the advice was followed.
    confidence: the probability p with which it was, 0 without advice.
    iteration: the result of the iteration that ends here, if one does.
    mentor: whose advice it considered, by its place; -1 without advice.

    """

    action: int
    followed: bool
    confidence: float
    iteration: IterationResult | None
    mentor: int


Announce = Callable[[Decision], None]

# The attributes that `Agent.state_dict` holds besides the arrays of the state.
COUNTERS = ('iterations_done', 'steps', 'finished', '_whole_episode', '_return', '_returns',
            '_iteration_steps', '_confidences', '_last_state', '_last_action', '_last_advice')


class Agent:
    """
    A learner that the nodes step observation by observation, and `Training` in compiled blocks.

    Parameters
    ----------
    config: its settings.
    seed: of its decisions.
    initial: values and beliefs that it begins with, also after a reset; None for none. Its
        schedules and random numbers begin anew: this does not continue the training before.
    mentors: names of those whose advice it takes; the only one may have none.

    Attributes
    ----------
    config: as given, or as changed by `reconfigure`.
    initial: as given.
    mentors: as given, and those that joined.
    earlier_advice: `advice[s]` received before this run, or with the initial learning; -1 where
        none. Of several mentors in rows, `advice[m * n_states + s]`.
    policy: `policy[s]` that it acts by while it does not learn.
    draws: the random numbers of its decisions, a row for each observation.
    state: what it has learned; set by `start`.
    kernel_config: the settings as kernels take them.
    step_types: what machine code of its steps depends on; None where plain Python is as good.
    steps, iterations_done: so far.
    finished: True when all iterations are done.

    """

    state: LearnerState

    def __init__(self, config: LearnerConfig, seed: int, initial: Learned | None = None,
                 mentors: Sequence[str] = ONE_MENTOR) -> None:
        self.config, self.initial, self._seed = config, initial, seed
        self.mentors = tuple(mentors)
        self.draws = UniformRows(random_streams(seed)[1], DRAWS)
        self._offered = PLAIN
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
        config, initial, n_mentors = self.config, self.initial, len(self.mentors)
        self._world = world
        policy, confidence = no_advice(world), np.zeros(n_mentors * world.n_states)
        self.earlier_advice = no_advice(world, n_mentors)
        if initial:
            names = initial.mentors, self.mentors
            state = begin_from(initial, world, config, self.mentors)
            self.earlier_advice = arranged_rows(initial.advice, *names, self.earlier_advice)
            if not config.learns:
                policy = initial.policy
                confidence = arranged_rows(initial.confidence, *names, confidence)
        else:
            state = initial_state(world, config, n_mentors)
        self._act_by(policy, confidence)
        self._use(state)
        self.iterations_done, self.steps, self.finished = 0, 0, False
        self._start_iteration()
        self._whole_episode, self._return = False, 0.0

    def add_mentor(self, name: str) -> None:
        """Take the advice of one mentor more, of whom nothing is known."""
        before, self.mentors = self.mentors, (*self.mentors, name)
        fresh = initial_state(self._world, self.config, len(self.mentors))
        self.earlier_advice = np.concatenate((self.earlier_advice, no_advice(self._world)))
        self._use(arranged_state(self.state, before, self.mentors, fresh))
        self._confidences += [0.0] * (len(self.no_confidences()) - len(self._confidences))
        self._last_advice = (*self._last_advice, NO_ACTION)

    def reset(self) -> None:
        """Return to the start, with the initial learning; the random numbers start again."""
        self.draws = UniformRows(random_streams(self._seed)[1], DRAWS)
        self.start(self._world)
        self.forget_last_action()

    def forget_last_action(self) -> None:
        """Learn nothing from the next reward: the last action did not lead to it."""
        self._last_state, self._last_action = 0, NO_ACTION
        self._last_advice = len(self.mentors) * (NO_ACTION,)

    def reconfigure(self, config: LearnerConfig, advice: ArrayLike) -> None:
        """
        Continue under other settings. A finished agent continues if `iterations` changed.

        advice: `advice[s]` that it received so far, on which it may act if it stops to learn.
        """
        before = self.config
        if before.learns and not config.learns:
            self._end_traces()  # no later episode shall change a value
            learned = self.learned(advice)
            self._act_by(learned.policy, learned.confidence)
        self.config = config
        self.finished = self.finished and config.iterations == before.iterations
        self._use(changed_state(self.state, self._world, before, config))

    def learned(self, advice: ArrayLike) -> Learned:
        """Return what was learned, as `learned_by`; advice: `advice[s]` that it received."""
        world = self._world
        received = np.array(advice, dtype=world.action_type)
        learned = learned_by(self.config, self.state, received, world, self.mentors)
        return learned if self.config.learns else learned._replace(
            policy=self.policy, confidence=self._confidence)

    def step(self, s: int, step: int, reward: float, terminated: bool, truncated: bool,
             advice: Sequence[int], announce: Announce | None = None) -> Decision:
        """
        Choose the action in state s, then learn from the reward of the last action.

        Parameters
        ----------
        step: of the episode; at 0 an episode starts, and the reward is 0.
        reward: of the action that led to s.
        terminated, truncated: whether the episode ends here, at a goal or at the step limit.
        advice: `advice[m]`, the action of each mentor in s, -1 for none.
        announce: called with the decision before anything is learned from the reward, in the
            middle of an episode.

        """
        u_listen, u_act = self.draws.row()
        kernels, config, arrays, learns = self._kernels, self._config, self._arrays, self.learns
        follows, ends = step > 0 and self._last_action != NO_ACTION, terminated or truncated
        a, p, m = kernels.choose_action(learns, s, step, terminated, advice, u_listen, u_act,
                                        config, arrays, self._policy_view)
        decision = Decision(a, u_listen < p, p, None, m)
        if announce and follows and not ends:
            announce(decision)
        if learns and follows:
            kernels.learn(self._last_state, self._last_action, reward, s, a, terminated,
                          self._last_advice, u_listen, config, arrays)
        if m >= 0:
            count_confidences(p, advice, self._confidences, self._plain_config, self._views)
        if follows:
            self._return += reward
            self._iteration_steps += 1
            self.steps += 1
        else:
            self._abandon_episode()
            self._whole_episode = step == 0
        self._last_state, self._last_action, self._last_advice = s, a, advice
        return decision._replace(iteration=self._finish_episode()) if ends else decision

    def finish_iteration(self, returns: list[float], confidences: Sequence[float],
                         steps: int) -> IterationResult:
        """
        Change the schedules at the end of an iteration, and return its result.

        Parameters
        ----------
        returns: of its episodes.
        confidences: number of its decisions with advice, and the sum of the confidences in that
            which counted; of several mentors, both for each of them too.
        steps: taken in it.

        """
        temperature = float(self.state.temperature[0])
        mean = mean_in_order(returns)
        if self.config.learns:
            decay_schedules(mean, self.kernel_config, self.state)
        self.iterations_done += 1
        self.finished = self.iterations_done == self.config.iterations
        confidence, *others = (float(total / count) if count else float('nan') for count, total
                               in zip(confidences[::2], confidences[1::2]))
        return IterationResult(self.iterations_done, mean, confidence, temperature, steps,
                               len(returns), tuple(others))

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
        if 'confidences' not in values:  # in checkpoints of before
            values = {**values, 'confidences': [values['advised'], values['confidence_sum']],
                      'last_advice': [values['last_advice']]}
        for name in COUNTERS:
            setattr(self, name, values[name.lstrip('_')])
        self.draws.skip_to(values['observations'])
        arrays = {**LATER_ARRAYS, **arrays}
        for name, array in self.state._asdict().items():
            saved = arrays[name]
            if saved.shape != array.shape:
                raise ValueError(f'{name} must have the shape {array.shape}, got {saved.shape}')
            array[...] = saved
        self.earlier_advice = arrays.get('earlier_advice',
                                         no_advice(self._world, len(self.mentors)))
        if not self.config.learns:
            self._act_by(arrays['policy'], arrays['policy_confidence'])

    def use_kernels(self, kernels: StepKernels) -> None:
        """Step with these kernels from now on, while they fit; the bits are the same."""
        self._offered = kernels
        fits = kernels.types is not None and kernels.types == self.step_types
        self._kernels = kernels if fits else PLAIN
        self._config, self._arrays = (self.kernel_config, self.state) if fits else (
            self._plain_config, self._views)

    @property
    def runs_machine_code(self) -> bool:
        """Whether its kernels are machine code, and not plain Python."""
        return self._kernels is not PLAIN

    def _use(self, state: LearnerState) -> None:
        self.state, self._views = state, state.views()
        self.kernel_config = self.config.for_kernels(self._world.n_actions, len(self.mentors))
        self._plain_config = plain_fields(self.kernel_config)
        self.step_types = step_types(self.kernel_config, state)
        self.use_kernels(self._offered)

    def _act_by(self, policy: NDArray[Any], confidence: NDArray[np.float64]) -> None:
        """Act by `policy[s]`, made with this confidence, while it does not learn."""
        self.policy, self._confidence = policy, confidence
        self._policy_view = plain_view(policy)

    def _start_iteration(self) -> None:
        self._returns: list[float] = []
        self._confidences, self._iteration_steps = self.no_confidences(), 0

    def no_confidences(self) -> list[float]:
        """Return the counts and sums of an iteration before its first decision."""
        others = len(self.mentors) if len(self.mentors) > 1 else 0
        return [0.0, 0.0] * (1 + others)

    def _abandon_episode(self) -> None:
        """End what led here; unless this is the start of an episode, it does not count."""
        self._end_traces()
        self._whole_episode, self._return = False, 0.0

    def _end_traces(self) -> None:
        self._kernels.finish_episode(self._config, self._arrays)

    def _finish_episode(self) -> IterationResult | None:
        if self._whole_episode and self.learns and len(self.kernel_config.has_model) > 0:
            count_fruitless_episode(self.kernel_config, self._views)
        self._end_traces()
        if self._whole_episode:
            self._returns.append(self._return)
            if self.learns and len(self.kernel_config.has_bandit) > 0:
                record_return(self._return, self.kernel_config, self._views)
        if len(self._returns) < self.config.episodes:
            return None
        result = self.finish_iteration(self._returns, self._confidences, self._iteration_steps)
        self._start_iteration()
        return result


def no_advice(world: World, n_mentors: int = 1) -> NDArray[Any]:
    """Return `advice[s]` of nobody: -1 in every state, for each mentor."""
    return np.full(n_mentors * world.n_states, NO_ACTION, dtype=world.action_type)


@kernel
def count_confidences(p: float, advice: Advice, confidences: list[float] | Array,
                      config: KernelConfig, state: LearnerState) -> None:
    """
    Change confidences, as `Agent.finish_iteration` takes them, by a decision with advice.

    p: in the advice that counted. advice: `advice[m]`, -1 for none.
    """
    confidences[0] += 1.0
    confidences[1] += p
    if len(config.mentors) > 1:
        for m in range(len(config.mentors)):
            if advice[m] >= 0:
                confidences[2 + 2 * m] += 1.0
                confidences[3 + 2 * m] += state.confidences[m]
