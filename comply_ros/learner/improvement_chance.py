# SPDX-License-Identifier: Apache-2.0
"""Chances that an action of a learner with a model is better than it looks."""

import math

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import (
    COUNT,
    LearnerState,
    OUTCOMES,
    SAMPLES,
    SUCCESSOR,
    USUAL,
    USUAL_COUNT,
    USUAL_VALUE,
)
from comply_ros.learner.outcome_sums import chance_of_higher, squares_around_means
from comply_ros.learner.prior_values import usual_probability
from comply_ros.learner.slip_prior import prior_size
from comply_ros.numerics.action_values import count_actions, NOTHING
from comply_ros.numerics.jit import kernel

NO_SLIPS_KNOWN = 2.0  # samples: a prior of slips that counts as no more has nothing to say


@kernel
def update_potential(s: int, greedy: int, margin: float, best_value: float,
                     best_successor: float, config: KernelConfig, state: LearnerState) -> None:
    """
    Change potential[s, a]: the chance to try a, since it may be better than the best action.

    By chance, or since it may lead to the best outcome known here: the larger chance counts.

    greedy: a best action. margin: a smaller difference of values does not count. best_value,
        best_successor: of the best outcome known.
    """
    for a in range(count_actions(config.actions)):
        state.potential[s, a] = 0.0
    if state.workspace[greedy, SAMPLES] > 0.0:
        _doubt_means(s, greedy, margin, config, state)
        if best_value > state.workspace[greedy, USUAL_VALUE] + margin:
            _doubt_usual_outcomes(s, greedy, best_successor, config, state)


@kernel
def _doubt_means(s: int, greedy: int, margin: float, config: KernelConfig,
                 state: LearnerState) -> None:
    """
    Change potential[s, a]: the mean of few samples may be too low by chance.

    The chance that a value d below the best one is in truth above it is 1 / (1 + exp(1.7 d / e)),
    close to that of a normal distribution; e is the error of a difference of two means, of n
    samples each and of K more of the prior. It counts `doubt_weight` times, and less where a
    prior of more than 2 samples has proved itself.
    """
    workspace, size = state.workspace, prior_size(config, state)
    squares, freedom = squares_around_means(s, config, state)
    if freedom <= 0.0 or squares <= margin * margin * freedom:  # rounding
        return
    weight = config.doubt_weight * min(1.0, NO_SLIPS_KNOWN / size)
    variance, best = squares / freedom, workspace[greedy, SAMPLES] + size
    for a in range(count_actions(config.actions)):
        if a != greedy and workspace[a, SAMPLES] > 0.0:
            error = math.sqrt(variance / (workspace[a, SAMPLES] + size) + variance / best)
            state.potential[s, a] = weight * chance_of_higher(
                state.q[s, greedy] - state.q[s, a], error)


@kernel
def _doubt_usual_outcomes(s: int, greedy: int, best_successor: float, config: KernelConfig,
                          state: LearnerState) -> None:
    """
    Change potential[s, a]: an action may have slipped so far, and be meant for the best outcome.

    Where the best action has another usual outcome, any other action may be the one that is meant
    to lead to the best outcome. An action that had its usual outcome d times more often is tried
    with probability ratio^d, the likelihood ratio of the two.
    """
    workspace, have, p = state.workspace, 0.0, usual_probability(state.pooled)
    if p == 1.0:
        return
    for a in range(count_actions(config.actions)):
        have += 1.0 if state.q[s, a] > NOTHING else 0.0
    ratio = min(1.0, (1.0 - p) / (p * max(have - 1.0, 1.0)))
    for a in range(count_actions(config.actions)):
        if a != greedy and workspace[a, SAMPLES] > 0.0 and workspace[a, USUAL] != best_successor:
            seen = 0.0
            for k in range(OUTCOMES):
                if state.model[s, a, k, COUNT] == 0.0:
                    break
                if state.model[s, a, k, SUCCESSOR] == best_successor:
                    seen = state.model[s, a, k, COUNT]
            chance = math.pow(ratio, workspace[a, USUAL_COUNT] - seen)
            state.potential[s, a] = max(state.potential[s, a], chance)
