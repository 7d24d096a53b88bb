# SPDX-License-Identifier: Apache-2.0
"""Action values of the planners, from the counts of all outcomes of each action."""

import math

from comply_ros.learner.learner_config import KernelConfig, MBIE_EB, PSRL, R_MAX
from comply_ros.learner.learner_state import (
    COUNT,
    LARGEST_REWARD,
    LearnerState,
    OUTCOMES,
    REWARD,
    SUCCESSOR,
    TERMINAL,
)
from comply_ros.numerics.action_values import count_actions, max_q_except, NOTHING
from comply_ros.numerics.jit import kernel, long_kernel


@long_kernel('has_planner', 0.0)
def plan_state(s: int, config: KernelConfig, state: LearnerState) -> float:
    """Change q[s]: compute the value of each action; return by how much the highest changed."""
    before = max_q_except(s, -1, state.q, config.actions)
    for a in range(count_actions(config.actions)):
        if state.q[s, a] > NOTHING:
            state.q[s, a] = planned_value(s, a, config, state)
    return abs(max_q_except(s, -1, state.q, config.actions) - before)


@kernel
def planned_value(s: int, a: int, config: KernelConfig, state: LearnerState) -> float:
    """
    Value of action a in state s, with n samples: (2.10) of the shares of its outcomes.

    An action never tried has the unknown value. R-MAX: while n is below m, `known_after`. MBIE-EB:
    `count_bonus` / sqrt(n) more. PSRL: the shares are those that were drawn, and an outcome not
    seen yet has the unknown value.
    """
    n, draws, total = state.visits[s, a] - 1.0, config.planner == PSRL, 0.0
    if n < (config.known_after if config.planner == R_MAX else 1):
        return unknown_value(config, state)
    for k in range(OUTCOMES):
        count = state.model[s, a, k, COUNT]
        if count == 0.0:
            break
        successor, value = state.model[s, a, k, SUCCESSOR], state.model[s, a, k, REWARD]
        if successor != TERMINAL:
            value += config.discount * state_value(int(successor), config, state)
        total += (state.sampled[s, a, k] if draws else count) * value
    if draws:
        return total + state.sampled[s, a, OUTCOMES] * unknown_value(config, state)
    return total / n + (config.count_bonus / math.sqrt(n) if config.planner == MBIE_EB else 0.0)


@kernel
def unknown_value(config: KernelConfig, state: LearnerState) -> float:
    """Value of what is not known: `untried_value` of the largest reward, over `initial_value`."""
    return config.initial_value + config.untried_value * state.pooled[LARGEST_REWARD]


@kernel
def state_value(s: int, config: KernelConfig, state: LearnerState) -> float:
    """Value of the best action of state s; that of what is not known where it was never left."""
    if state.departures[s] == 1.0:
        return unknown_value(config, state)
    return max_q_except(s, -1, state.q, config.actions)


@kernel
def chance(s: int, s2: int, config: KernelConfig, state: LearnerState) -> float:
    """Share of s2 in the samples of that action of state s that leads there most often."""
    most = 0.0
    for a in range(count_actions(config.actions)):
        for k in range(OUTCOMES):
            count = state.model[s, a, k, COUNT]
            if count == 0.0:
                break
            if state.model[s, a, k, SUCCESSOR] == s2:
                most = max(most, count / (state.visits[s, a] - 1.0))
    return most
