# SPDX-License-Identifier: Apache-2.0
"""Choice of a learner with a model: advice, an action never tried, one in doubt, or the best."""

from comply_ros.learner.advice_chance import advice_chance
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
def exploration_chances(s: int, advice: Advice, config: KernelConfig,
                        state: LearnerState) -> tuple[float, float]:
    """
    Probabilities of trying an action of state s: one never tried, and one in doubt.

    The second one is that of an action that may be better than it looks, where none is tried that
    never was. Both are as much less as advice that holds is trusted.
    """
    new, doubtful = 0.0, 0.0
    if count_untried(s, state.q, state.visits, config.actions) > 0:
        new = config.exploration_probability
    for a in range(count_actions(config.actions)):
        doubtful += state.potential[s, a]
    if new > 0.0 or doubtful > 0.0:
        doubt = _doubt_here(s, advice, config, state)
        new, doubtful = new * doubt, doubtful * doubt
    return new, min(doubtful, 1.0)


@kernel
def _doubt_here(s: int, advice: Advice, config: KernelConfig, state: LearnerState) -> float:
    """Probability that all advice that holds in state s is wrong; 1 where none does."""
    doubt, least = 1.0, 1.0
    for m in range(len(config.mentors)):
        if advice[m] >= 0 and advice_chance(s, m, advice[m], config, state) > 0.0:
            doubt *= doubt_of(m, state)
            if len(config.mentors) > 1:
                least = min(least, 1.0 - share_of_advice(s, advice[m], config, state))
    return min(doubt, least)


@long_kernel('has_model', 0.0)
def following_probability(s: int, m: int, advice: Advice, config: KernelConfig,
                          state: LearnerState) -> float:
    """Probability of following mentor m: that its advice is right, unless another is explored."""
    chance = advice_chance(s, m, advice[m], config, state)
    if chance == 0.0:
        return 0.0
    new, doubtful = exploration_chances(s, advice, config, state)
    return chance * ((1.0 - new) * (1.0 - doubtful))


@long_kernel('has_model', 0)
def model_action(s: int, advice: Advice, u_listen: float, u_act: float, config: KernelConfig,
                 state: LearnerState) -> int:
    """
    Return an action never tried, one that may be better than it looks, or a best one.

    advice: `advice[m]`, -1 for none; it was not followed. u_listen, u_act: uniform in [0, 1).
    """
    new, doubtful = exploration_chances(s, advice, config, state)
    if u_listen >= 1.0 - new:
        return _new_action(s, advice, u_act, config, state)
    if u_listen >= (1.0 - new) * (1.0 - doubtful):
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
