# SPDX-License-Identifier: Apache-2.0
"""Policy shaping: advice multiplies the softmax, by how often that of its mentor is right."""

import math

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import Advice, LearnerState
from comply_ros.numerics.action_values import count_actions, max_q_except, NOTHING
from comply_ros.numerics.jit import kernel, long_kernel


@kernel
def policy_shaping_confidence(s: int, a: int, advice: Advice, config: KernelConfig,
                              state: LearnerState) -> float:
    """
    Probability of action a where advice multiplies the softmax (2.24) (preset `policy_shaping`).

    The share C of right advice, the scheduled confidence or an estimate of each mentor, makes the
    odds of an advised action higher: see `shaped_weight`.
    """
    best, others = max_q_except(s, -1, state.q, config.actions), 0.0
    if len(config.mentors) == 1 and len(config.has_estimates) == 0:
        consistency, temperature = state.scheduled_confidence[0], state.temperature[0]
        for b in range(count_actions(config.actions)):
            if b != a:
                others += math.exp((state.q[s, b] - best) / temperature)
        right = consistency * math.exp((state.q[s, a] - best) / temperature)
        wrong = (1.0 - consistency) * others
        return right / (right + wrong) if right > 0.0 else 0.0
    for b in range(count_actions(config.actions)):
        if b != a:
            others += shaped_weight(s, b, best, advice, config, state)
    mine = shaped_weight(s, a, best, advice, config, state)
    return mine / (mine + others) if mine > 0.0 else 0.0


@kernel
def shaped_weight(s: int, a: int, best: float, advice: Advice, config: KernelConfig,
                  state: LearnerState) -> float:
    """
    Weight of action a in state s: that of the softmax (2.24), shaped by all advice.

    It is multiplied by C for each mentor that recommends a, and by 1 - C for each that recommends
    another action. With C estimated, 1 - C is shared by all actions that are not recommended.
    """
    consistency = state.scheduled_confidence[0]
    weight = math.exp((state.q[s, a] - best) / state.temperature[0])
    for m in range(len(config.mentors)):
        if advice[m] >= 0:
            if len(config.has_estimates) > 0:
                weight *= estimated_likelihood(s, a, m, advice[m], config, state)
            else:
                weight *= consistency if advice[m] == a else 1.0 - consistency
    return weight


@kernel
def estimated_consistency(m: int, state: LearnerState) -> float:
    """
    Estimated probability C that advice of mentor m is the best action: (agreed + 1) / (seen + 2).

    Of the counts without the 1 that both begin with: the mean of a Beta belief that begins as
    Beta(1, 1).
    """
    return state.advice_agreed[m] / (state.advice_seen[m] + 1.0)


@kernel
def estimated_likelihood(s: int, a: int, m: int, advice: int, config: KernelConfig,
                         state: LearnerState) -> float:
    """Probability that mentor m gives this advice in state s if action a is the best one there."""
    consistency, others = estimated_consistency(m, state), -1
    if advice == a:
        return consistency
    for b in range(count_actions(config.actions)):
        others += int(state.q[s, b] > NOTHING)
    return (1.0 - consistency) / max(1, others)


@long_kernel('has_estimates', None)
def record_consistency(s: int, advice: Advice, config: KernelConfig, state: LearnerState) -> None:
    """
    Change the counts of all mentors with advice in state s, by the action values there.

    Each has given advice once more, and has been right as often as it is probable that its advice
    is the best action: the weight of `shaped_weight` among those of all actions.

    advice: `advice[m]`, -1 for none.
    """
    best, total = max_q_except(s, -1, state.q, config.actions), 0.0
    for a in range(count_actions(config.actions)):
        state.workspace[a, 0] = shaped_weight(s, a, best, advice, config, state)
        total += state.workspace[a, 0]
    for m in range(len(config.mentors)):
        if advice[m] >= 0:
            state.advice_seen[m] += 1.0
            state.advice_agreed[m] += state.workspace[advice[m], 0] / total
