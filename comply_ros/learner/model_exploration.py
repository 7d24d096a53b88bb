# SPDX-License-Identifier: Apache-2.0
"""Choice of a learner with a model: advice, an action never tried, one in doubt, or the best."""

from comply_ros.learner.advice_chance import advice_chance, advice_holds
from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import Advice, LearnerState
from comply_ros.learner.prior_values import doubt_of, record_of, share_of_advice
from comply_ros.numerics.action_values import (
    count_actions,
    count_untried,
    greedy_or_untried_action,
    NOTHING,
)
from comply_ros.numerics.jit import kernel, long_kernel
from comply_ros.world.grid import NO_ACTION


@kernel
def new_probability(s: int, advice: Advice, config: KernelConfig, state: LearnerState) -> float:
    """Probability of trying an action of state s that was never tried; 0 where there is none."""
    if count_untried(s, state.q, state.visits, config.actions) == 0:
        return 0.0
    return config.exploration_probability * _doubt_here(s, advice, config, state)


@kernel
def _doubt_here(s: int, advice: Advice, config: KernelConfig, state: LearnerState) -> float:
    """Probability that all advice that holds in state s is wrong; 1 where none does."""
    doubt = 1.0
    for m in range(len(config.mentors)):
        if advice[m] >= 0 and advice_holds(s, m, advice[m], config, state):
            doubt *= doubt_of(m, state)
    if len(config.mentors) > 1:
        for m in range(len(config.mentors)):
            if advice[m] >= 0 and advice_holds(s, m, advice[m], config, state):
                doubt = min(doubt, 1.0 - share_of_advice(s, advice[m], config, state))
    return doubt


@kernel
def doubtful_probability(s: int, advice: Advice, config: KernelConfig,
                         state: LearnerState) -> float:
    """Probability of trying an action of state s that may be better than it looks."""
    total = 0.0
    for a in range(count_actions(config.actions)):
        total += state.potential[s, a]
    if total > 0.0:
        total *= _doubt_here(s, advice, config, state)
    return min(total, 1.0)


@long_kernel('has_model', 0.0)
def following_probability(s: int, m: int, advice: Advice, config: KernelConfig,
                          state: LearnerState) -> float:
    """Probability of following mentor m: that its advice is right, unless another is explored."""
    chance = advice_chance(s, m, advice[m], config, state)
    if chance == 0.0:
        return 0.0
    return chance * _greedy_probability(s, advice, config, state)


@kernel
def _greedy_probability(s: int, advice: Advice, config: KernelConfig,
                        state: LearnerState) -> float:
    """Probability of exploring nothing in state s."""
    return (1.0 - new_probability(s, advice, config, state)) * (
        1.0 - doubtful_probability(s, advice, config, state))


@long_kernel('has_model', 0)
def model_action(s: int, advice: Advice, u_listen: float, u_act: float, config: KernelConfig,
                 state: LearnerState) -> int:
    """
    Return an action never tried, one that may be better than it looks, or a best one.

    advice: `advice[m]`, -1 for none; it was not followed. u_listen, u_act: uniform in [0, 1).
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
def _new_action(s: int, advice: Advice, u: float, config: KernelConfig,
                state: LearnerState) -> int:
    """Return an action never tried; not the advice of mentors that are more often wrong."""
    count, usable = count_untried(s, state.q, state.visits, config.actions), 0
    for a in range(count_actions(config.actions)):
        if state.q[s, a] > NOTHING and state.visits[s, a] == 1.0:
            usable += int(not _is_bad_advice(a, advice, config, state))
    pick = min(int(u * (usable if usable > 0 else count)), (usable if usable > 0 else count) - 1)
    for a in range(count_actions(config.actions)):
        if state.q[s, a] > NOTHING and state.visits[s, a] == 1.0 and not (
                usable > 0 and _is_bad_advice(a, advice, config, state)):
            if pick == 0:
                return a
            pick -= 1
    return NO_ACTION


@kernel
def _is_bad_advice(a: int, advice: Advice, config: KernelConfig, state: LearnerState) -> bool:
    """Whether action a is advised, and only by mentors that are more often wrong than right."""
    found = False
    for m in range(len(config.mentors)):
        if advice[m] >= 0 and advice[m] == a:
            if record_of(m, state) >= 0.5:
                return False
            found = True
    return found
