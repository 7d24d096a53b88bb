# SPDX-License-Identifier: Apache-2.0
"""Sums over all outcomes that were seen in a state, and how sure the values of actions are."""

import math

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import (
    COUNT,
    LearnerState,
    OUTCOMES,
    REWARD,
    SAMPLES,
    SQUARE_SUM,
    SUCCESSOR,
    TERMINAL,
    USUAL,
    USUAL_COUNT,
    USUAL_VALUE,
    VALUE_SUM,
)
from comply_ros.numerics.action_values import count_actions, NOTHING
from comply_ros.numerics.jit import kernel

TOLERANCE = 3e-4  # of the largest reward: smaller changes of a value are not passed on
NORMAL = 1.7  # 1 / (1 + exp(1.7 x)) is close to the chance that a normal variable exceeds x
NO_CHANCE = 8.0  # errors: a value that lies further below another one is not the higher one


@kernel
def sum_up(s: int, config: KernelConfig,
           state: LearnerState) -> tuple[float, float, float, float]:
    """
    Change the workspace: what is known of each action of state s.

    Return the samples of all actions, the sum of their values, and of all outcomes seen in s the
    one with the highest value: this value and its successor.
    """
    model, workspace = state.model, state.workspace
    samples, value_sum, best_value, best_successor = 0.0, 0.0, NOTHING, TERMINAL
    for a in range(count_actions(config.actions)):
        workspace[a, SAMPLES], workspace[a, VALUE_SUM] = 0.0, 0.0
        workspace[a, USUAL_COUNT], workspace[a, SQUARE_SUM] = 0.0, 0.0
        for k in range(OUTCOMES):
            count = model[s, a, k, COUNT]
            if count == 0.0:
                break
            successor = model[s, a, k, SUCCESSOR]
            following = 0.0 if successor == TERMINAL else state.values[int(successor)]
            value = model[s, a, k, REWARD] + config.discount * following
            workspace[a, SAMPLES] += count
            workspace[a, VALUE_SUM] += count * value
            workspace[a, SQUARE_SUM] += count * value * value
            if count > workspace[a, USUAL_COUNT]:
                workspace[a, USUAL_COUNT], workspace[a, USUAL] = count, successor
                workspace[a, USUAL_VALUE] = value
            if value > best_value:
                best_value, best_successor = value, successor
        samples += workspace[a, SAMPLES]
        value_sum += workspace[a, VALUE_SUM]
    return samples, value_sum, best_value, best_successor


@kernel
def store_sample_squares(s: int, config: KernelConfig, state: LearnerState) -> None:
    """Change sample_squares[s]: from what `sum_up` left, and how rewards of an outcome differ."""
    workspace = state.workspace
    for a in range(count_actions(config.actions)):
        n, total = workspace[a, SAMPLES], workspace[a, VALUE_SUM]
        if n > 0.0:
            around = max(0.0, workspace[a, SQUARE_SUM] - total / n * total)  # rounding
            state.sample_squares[s, a] = around + state.reward_squares[s, a]


@kernel
def squares_around_means(s: int, config: KernelConfig,
                         state: LearnerState) -> tuple[float, float]:
    """
    Return how the values of all samples of state s vary around the means of their actions.

    The sum of their squared distances, and the number of samples minus that of the actions tried.
    """
    squares, freedom = 0.0, 0.0
    for a in range(count_actions(config.actions)):
        squares += state.sample_squares[s, a]
        freedom += max(0.0, state.visits[s, a] - 2.0)
    return squares, freedom


@kernel
def chance_of_higher(below: float, error: float) -> float:
    """
    Chance that a value which lies below another one is in truth the higher one; 1/2 at the most.

    below: by how much it does. error: standard error of their difference, above 0.
    """
    if below >= NO_CHANCE * error:
        return 0.0
    return 1.0 / (1.0 + math.exp(NORMAL * below / error))
