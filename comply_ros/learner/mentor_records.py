# SPDX-License-Identifier: Apache-2.0
"""Records of the mentors of a learner with a model: whether advice holds, and how often it did."""

import math

from comply_ros.learner.learner_config import KernelConfig, TRACK_RECORD
from comply_ros.learner.learner_state import Advice, Array, LearnerState, SCALE
from comply_ros.learner.prior_values import (
    credit,
    expected_untried_value,
    outcome_spread,
)
from comply_ros.numerics.action_values import count_actions, count_untried, max_q_except, NOTHING
from comply_ros.numerics.jit import kernel, long_kernel

SAME = 2e-3  # of the largest reward: values that differ by less count as equally good
MOST_RETURNS = 4.0  # to a state in an episode; after more the robot seems to go round in circles
MORE_RETURNS = 4.0  # the same, in addition, where outcomes are as random as can be


@kernel
def in_loop(s: int, state: LearnerState) -> bool:
    """Whether the episode was in state s so often that it seems to go round in circles."""
    return state.traces[s, 0] > most_returns(state.pooled)


@kernel
def most_returns(pooled: Array) -> float:
    """Return how often an episode may be in a state; slips too lead back to it."""
    return MOST_RETURNS + MORE_RETURNS * outcome_spread(pooled)


@kernel
def advice_slack(s: int, m: int, advice: int, config: KernelConfig, state: LearnerState) -> float:
    """
    By how much the value of advice of mentor m may lie below the best one, before it is worse.

    The error of a value that was estimated from n samples of outcomes as random as those of this
    world falls with the root of n; and values that differ by less than `SAME` are equally good.
    Nothing for a mentor without credit.
    """
    spread = outcome_spread(state.pooled)
    trust = credit(s, m, advice, config, state)
    slack = (config.advice_slack * spread / math.sqrt(state.visits[s, advice]) + SAME) * trust
    return slack * state.pooled[SCALE]


@kernel
def advice_holds(s: int, m: int, advice: int, config: KernelConfig, state: LearnerState) -> bool:
    """Whether advice of mentor m is as good as any other action, for all that is known."""
    best = max_q_except(s, -1, state.q, config.actions)
    if in_loop(s, state):
        untried = count_untried(s, state.q, state.visits, config.actions)
        return state.q[s, advice] >= best and untried == 0
    return state.q[s, advice] >= best - advice_slack(s, m, advice, config, state)


@long_kernel('has_model', None)
def hear_advice(s: int, advice: Advice, config: KernelConfig, state: LearnerState) -> None:
    """
    Change the advice known in s, the values of actions never tried, and the mentors' records.

    Advice counts for the record once it was tried, and another action of the state too; and
    against it where it leads round in circles.

    advice: `advice[m]`, -1 for none.
    """
    for m in range(len(config.mentors)):
        if advice[m] >= 0 and config.trust == TRACK_RECORD:
            state.advised[m * len(state.departures) + s] = advice[m]
    looping = in_loop(s, state)
    for a in range(count_actions(config.actions)):
        if state.q[s, a] > NOTHING and state.visits[s, a] == 1.0:
            state.q[s, a] = expected_untried_value(s, a, looping, config, state)
    for m in range(len(config.mentors)):
        if advice[m] >= 0 and config.trust == TRACK_RECORD:
            _record_advice(s, m, advice[m], looping, config, state)


@kernel
def _record_advice(s: int, m: int, advice: int, looping: bool, config: KernelConfig,
                   state: LearnerState) -> None:
    """Change the record of mentor m by its advice in state s, also good if `SAME` worse."""
    best_tried, value = NOTHING, state.q[s, advice]
    for a in range(count_actions(config.actions)):
        if a != advice and state.visits[s, a] > 1.0 and state.q[s, a] > best_tried:
            best_tried = state.q[s, a]
    if looping and not (value > best_tried and advice_holds(s, m, advice, config, state)):
        state.advice_seen[m] += 1.0
    elif state.visits[s, advice] > 1.0 and best_tried > NOTHING:
        state.advice_seen[m] += 1.0
        slack = advice_slack(s, m, advice, config, state) + SAME * state.pooled[SCALE]
        if value >= best_tried - slack:
            state.advice_agreed[m] += 1.0
