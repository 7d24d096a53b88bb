# SPDX-License-Identifier: Apache-2.0
"""Probability that advice is as good as any other action, for a learner with a model."""

import math

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import Array, CHANGE, LearnerState, SCALE
from comply_ros.learner.outcome_sums import chance_of_higher, TOLERANCE
from comply_ros.learner.prior_values import (
    credit,
    outcome_spread,
    record_of,
    scale_of_rewards,
    share_of_advice,
    usual_probability,
)
from comply_ros.learner.slip_prior import prior_size
from comply_ros.numerics.action_values import count_actions, count_untried, max_q_except, NOTHING
from comply_ros.numerics.jit import kernel
from comply_ros.world.grid import NO_ACTION

SAME = 2e-3  # of the largest reward: values that differ by less count as equally good
MOST_RETURNS = 4.0  # to a state in an episode; after more the robot seems to go round in circles
MORE_RETURNS = 24.0  # the same, in addition, times the chance of a slip
TRUSTED = 0.64  # credit from which on what was never tried does not speak against advice
NEARLY_SURE = 0.995  # a mentor counts as no more often right than this
MOST_FREEDOM = 4.0  # degrees of freedom that the variance of one action counts with
LIKE_OTHERS = 2.0  # samples of the typical variance, beside the own ones of an action
UNSETTLED = 0.3  # error of a value, of its change from visit to visit, where outcomes are random


@kernel
def in_loop(s: int, state: LearnerState) -> bool:
    """Whether the episode was in state s so often that it seems to go round in circles."""
    return state.traces[s, 0] > most_returns(state.pooled)


@kernel
def most_returns(pooled: Array) -> float:
    """Return how often an episode may be in a state; slips too lead back to it."""
    return MOST_RETURNS + MORE_RETURNS * (1.0 - usual_probability(pooled))


@kernel
def advice_chance(s: int, m: int, advice: int, config: KernelConfig, state: LearnerState) -> float:
    """
    Probability that advice of mentor m in state s is as good as any other action; 0 below 1/2.

    Advice holds where it is not 0.
    Where its value is the highest, 1. Else `believed_chance`, of the record of the mentor and the
    chance that the other value is higher only by its few samples. In a loop, advice must be the
    best of actions that were all tried.
    """
    best, value = max_q_except(s, -1, state.q, config.actions), state.q[s, advice]
    if in_loop(s, state):
        untried = count_untried(s, state.q, state.visits, config.actions)
        return 1.0 if value >= best and untried == 0 else 0.0
    other = best_tried(s, NO_ACTION, config, state)
    trust, was_tried = credit(s, m, advice, config, state), state.visits[s, advice] > 1.0
    if was_tried and trust > TRUSTED:
        best = state.q[s, other]
    if value >= best - SAME * trust * scale_of_rewards(state.pooled):
        return 1.0
    if not was_tried or state.q[s, other] < best:
        return 0.0
    rho = record_of(m, state)
    if len(config.mentors) > 1:
        rho = share_of_advice(s, advice, config, state)
    chance = believed_chance(chance_as_good(s, advice, other, config, state), rho)
    return chance if chance >= 0.5 else 0.0


@kernel
def believed_chance(p: float, rho: float) -> float:
    """
    Probability that advice is right, by Bayes' rule: P rho / (P rho + (1 - P) (1 - rho)).

    p: chance P that it is, by its value alone. rho: record of its mentor.
    """
    known = min(rho, NEARLY_SURE)
    return p * known / (p * known + (1.0 - p) * (1.0 - known))


@kernel
def best_tried(s: int, excluded: int, config: KernelConfig, state: LearnerState) -> int:
    """Return the best action of state s of those that were tried, but for one; -1: none."""
    best, value = NO_ACTION, NOTHING
    for a in range(count_actions(config.actions)):
        if a != excluded and state.visits[s, a] > 1.0 and state.q[s, a] > value:
            best, value = a, state.q[s, a]
    return best


@kernel
def chance_as_good(s: int, a: int, other: int, config: KernelConfig,
                   state: LearnerState) -> float:
    """
    Chance that action a of state s is in truth as good as another one, of a higher value.

    See `chance_of_higher`. Values are means of samples, with an error each. Besides, where
    outcomes are random, a value that changes from visit to visit is not known better than that.
    Changes nothing: it is part of a choice.
    """
    variance, margin = typical_variance(s, config, state), TOLERANCE * state.pooled[SCALE]
    if variance <= margin * margin:  # rounding
        return 0.0
    change = UNSETTLED * outcome_spread(state.pooled) * state.value_changes[s, CHANGE]
    error = math.sqrt(squared_error(s, a, variance, config, state)
                      + squared_error(s, other, variance, config, state) + change * change)
    return chance_of_higher(state.q[s, other] - state.q[s, a], error)


@kernel
def typical_variance(s: int, config: KernelConfig, state: LearnerState) -> float:
    """
    Variance of the values of samples of one action of state s, in the mean over its actions.

    An action with more samples counts more, but none more than one with 5. Besides, one sample of
    a standard deviation of `advice_slack` of the largest reward is supposed, or less where
    outcomes are less random.
    """
    supposed = config.advice_slack * outcome_spread(state.pooled) * state.pooled[SCALE]
    total, weights = supposed * supposed, 1.0
    for a in range(count_actions(config.actions)):
        freedom = state.visits[s, a] - 2.0
        if freedom > 0.0:
            weight = min(freedom, MOST_FREEDOM)
            total += weight * state.sample_squares[s, a] / freedom
            weights += weight
    return total / weights


@kernel
def squared_error(s: int, a: int, variance: float, config: KernelConfig,
                  state: LearnerState) -> float:
    """
    Squared error of the value of action a of state s, which was tried.

    Its samples have a variance of their own, which two samples of the typical variance are added
    to: an action that hardly varies says nothing of one that was tried three times.
    """
    n = state.visits[s, a] - 1.0
    own = (state.sample_squares[s, a] + LIKE_OTHERS * variance) / (n - 1.0 + LIKE_OTHERS)
    return own / (n + prior_size(config, state))
