# SPDX-License-Identifier: Apache-2.0
"""The kernels that an agent calls in a step: plain Python, or machine code of the same bits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from comply_ros.learner.choose_and_learn import choose_action
from comply_ros.learner.learner_config import KernelConfig, LearnerConfig
from comply_ros.learner.learner_state import Advice, initial_state, LearnerState
from comply_ros.learner.update_rules import learn
from comply_ros.learner.usual_outcome_model import finish_episode
from comply_ros.numerics.jit import cached, specialized
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.state_action_spaces import Spaces

NO_POLICY = np.full(1, NO_ACTION, dtype=np.int8)  # a learner that learns does not act by one
Kernel = Callable[..., Any]
StepTypes = tuple[Any, ...]  # see `step_types`


class StepKernels(NamedTuple):
    """
    Kernels that are called alike, whether plain Python or machine code.

    Attributes
    ----------
    choose_action, learn, finish_episode: the kernels.
    types: what they are compiled for; None for plain Python, which takes memoryviews too.

    """

    choose_action: Kernel
    learn: Kernel
    finish_episode: Kernel
    types: StepTypes | None


PLAIN = StepKernels(choose_action, learn, finish_episode, None)


def step_types(config: KernelConfig, state: LearnerState) -> StepTypes | None:
    """
    Return all that the machine code of a step depends on; None where plain Python is as good.

    Without a model, a step takes some microseconds in plain Python too.
    """
    if not (config.learns and config.learns_model):
        return None
    kinds = ((array.dtype.str, array.ndim, array.flags.c_contiguous, array.flags.writeable)
             for array in state)
    return config.actions, len(config.mentors), *kinds


def compiled_kernels(config: KernelConfig, state: LearnerState) -> StepKernels:
    """
    Return the kernels as machine code for arrays of these types; `PLAIN` where there is none.

    Nothing is changed. To compile takes 40 s, to load what was compiled before 1 s.
    """
    return _kernels(specialized, config, state) or PLAIN


def cached_kernels(config: KernelConfig, state: LearnerState) -> StepKernels | None:
    """Return `compiled_kernels` if they were compiled before; else None, at once."""
    return _kernels(cached, config, state)


def compile_step(n_actions: int, n_mentors: int) -> None:
    """Compile what a learner with a model calls in a world, for the cache of compiled code."""
    world = World(Spaces(1, tuple(map(str, range(n_actions))), 1))
    config = LearnerConfig(learns_model=True)
    compiled_kernels(config.for_kernels(n_actions, n_mentors),
                     initial_state(world, config, n_mentors))


def _kernels(load: Callable[..., Kernel | None], config: KernelConfig,
             state: LearnerState) -> StepKernels | None:
    array = np.full(len(config.mentors), NO_ACTION)  # machine code takes arrays
    choose = load(choose_action, True, 0, 0, False, array, 0.0, 0.0, config, state, NO_POLICY)
    update = load(learn, 0, 0, 0.0, 0, 0, False, array, 0.0, config, state)
    finish = load(finish_episode, config, state)
    if choose in (None, choose_action) or update is None or finish is None:
        return None

    def choose_with_array(learns: bool, s: int, step: int, terminated: bool, advice: Advice,
                          u_listen: float, u_act: float, config: KernelConfig,
                          state: LearnerState, policy: Any) -> tuple[int, float, int]:
        array[:] = advice
        return choose(learns, s, step, terminated, array, u_listen, u_act, config, state,
                      NO_POLICY)

    def learn_with_array(s: int, a: int, r: float, s2: int, a2: int, done: bool, advice: Advice,
                         u: float, config: KernelConfig, state: LearnerState) -> None:
        array[:] = advice
        update(s, a, r, s2, a2, done, array, u, config, state)
    return StepKernels(choose_with_array, learn_with_array, finish, step_types(config, state))
