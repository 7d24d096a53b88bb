# SPDX-License-Identifier: Apache-2.0
"""Record of a mentor of a learner with a model: whether its advice holds, and how often it did."""

import math

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import LearnerState, SCALE
from comply_ros.learner.prior_values import (
    credence,
    expected_untried_value,
    outcome_spread,
)
from comply_ros.numerics.action_values import count_actions, count_untried, max_q_except, NOTHING
from comply_ros.numerics.jit import kernel, long_kernel

MOST_RETURNS = 7.0  # of an episode to a state; after more it seems to go round in circles


@kernel
def in_loop(s: int, state: LearnerState) -> bool:
    """Whether the episode was in state s so often that it seems to go round in circles."""
    return state.traces[s, 0] > MOST_RETURNS


@kernel
def advice_slack(s: int, advice: int, config: KernelConfig, state: LearnerState) -> float:
    """
    By how much the value of advice may lie below the best one, before it counts as worse.

    The error of a value that was estimated from n samples of outcomes as random as those of this
    world falls with the root of n. Nothing for a mentor without credit; less and less in a loop.
    """
    spread = outcome_spread(state.pooled) * state.pooled[SCALE]
    slack = config.advice_slack * spread * credence(state) / math.sqrt(state.visits[s, advice])
    return slack / max(1.0, state.traces[s, 0] - MOST_RETURNS)


@kernel
def advice_holds(s: int, advice: int, config: KernelConfig, state: LearnerState) -> bool:
    """Whether advice is as good as any other action, for all that is known."""
    best = max_q_except(s, -1, state.q, config.actions)
    if in_loop(s, state):
        untried = count_untried(s, state.q, state.visits, config.actions)
        return state.q[s, advice] >= best and untried == 0
    return state.q[s, advice] >= best - advice_slack(s, advice, config, state)


@long_kernel('has_model', None)
def hear_advice(s: int, advice: int, config: KernelConfig, state: LearnerState) -> None:
    """
    Change advised[s], the values of actions never tried, and the record of the mentor.

    Advice counts for the record once it was tried, and another action of the state too; and
    against it where it leads round in circles.

    advice: -1 for none.
    """
    if advice >= 0:
        state.advised[s] = advice
    best_tried, looping = NOTHING, in_loop(s, state)
    for a in range(count_actions(config.actions)):
        if state.q[s, a] > NOTHING and state.visits[s, a] == 1.0:
            state.q[s, a] = expected_untried_value(s, a, looping, config, state)
        elif a != advice and state.q[s, a] > best_tried:
            best_tried = state.q[s, a]
    if advice < 0:
        return
    value = state.q[s, advice]
    if looping and not (value > best_tried and advice_holds(s, advice, config, state)):
        state.advice_seen[0] += 1.0
    elif state.visits[s, advice] > 1.0 and best_tried > NOTHING:
        state.advice_seen[0] += 1.0
        if value >= best_tried - advice_slack(s, advice, config, state):
            state.advice_agreed[0] += 1.0
