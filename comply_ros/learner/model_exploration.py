# SPDX-License-Identifier: Apache-2.0
"""Choice of a learner with a model: advice, an action never tried, one in doubt, or the best."""

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import LearnerState
from comply_ros.learner.prior_values import doubt_of, record_of
from comply_ros.learner.track_record import advice_holds
from comply_ros.numerics.action_values import (
    count_actions,
    count_untried,
    greedy_or_untried_action,
    NOTHING,
)
from comply_ros.numerics.jit import kernel, long_kernel
from comply_ros.world.grid import NO_ACTION


@kernel
def new_probability(s: int, advice: int, config: KernelConfig, state: LearnerState) -> float:
    """Probability of trying an action of state s that was never tried; 0 where there is none."""
    if count_untried(s, state.q, state.visits, config.actions) == 0:
        return 0.0
    if advice >= 0 and advice_holds(s, advice, config, state):
        return config.exploration_probability * doubt_of(state)
    return config.exploration_probability


@kernel
def doubtful_probability(s: int, advice: int, config: KernelConfig, state: LearnerState) -> float:
    """Probability of trying an action of state s that may be better than it looks."""
    total = 0.0
    for a in range(count_actions(config.actions)):
        total += state.potential[s, a]
    if total > 0.0 and advice >= 0 and advice_holds(s, advice, config, state):
        total *= doubt_of(state)
    return min(total, 1.0)


@long_kernel('has_model', 0.0)
def following_probability(s: int, advice: int, config: KernelConfig,
                          state: LearnerState) -> float:
    """Probability of following advice: where it holds, unless another action is explored."""
    if not advice_holds(s, advice, config, state):
        return 0.0
    return _greedy_probability(s, advice, config, state)


@kernel
def _greedy_probability(s: int, advice: int, config: KernelConfig, state: LearnerState) -> float:
    """Probability of exploring nothing in state s."""
    return (1.0 - new_probability(s, advice, config, state)) * (
        1.0 - doubtful_probability(s, advice, config, state))


@long_kernel('has_model', 0)
def model_action(s: int, advice: int, u_listen: float, u_act: float, config: KernelConfig,
                 state: LearnerState) -> int:
    """
    Return an action never tried, one that may be better than it looks, or a best one.

    advice: -1 for none; it was not followed. u_listen, u_act: uniform in [0, 1).
    """
    if u_listen >= 1.0 - new_probability(s, advice, config, state):
        return _new_action(s, advice, u_act, config, state)
    if u_listen >= _greedy_probability(s, advice, config, state):
        return _doubtful_action(s, u_act, config, state)
    return greedy_or_untried_action(s, False, u_act, state.q, state.visits, config.actions)


@kernel
def _doubtful_action(s: int, u: float, config: KernelConfig, state: LearnerState) -> int:
    """Draw an action of state s with a chance in proportion to its potential."""
    total, last = 0.0, NO_ACTION
    for a in range(count_actions(config.actions)):
        total += state.potential[s, a]
    x = u * total
    for a in range(count_actions(config.actions)):
        if state.potential[s, a] > 0.0:
            last = a
            if x < state.potential[s, a]:
                return a
            x -= state.potential[s, a]
    return last  # rounded, x may stay above what is left


@kernel
def _new_action(s: int, advice: int, u: float, config: KernelConfig, state: LearnerState) -> int:
    """Return an action never tried; not the advice of a mentor that is more often wrong."""
    count, left_out = count_untried(s, state.q, state.visits, config.actions), -1
    if advice >= 0 and count > 1 and state.visits[s, advice] == 1.0 and record_of(state) < 0.5:
        left_out, count = advice, count - 1
    pick = min(int(u * count), count - 1)
    for a in range(count_actions(config.actions)):
        if a != left_out and state.q[s, a] > NOTHING and state.visits[s, a] == 1.0:
            if pick == 0:
                return a
            pick -= 1
    return NO_ACTION
