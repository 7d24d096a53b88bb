# SPDX-License-Identifier: Apache-2.0
"""Choice of the next action: the advice, the softmax (2.24), the best action, or a new one."""

import math

from comply_ros.learner.confidence import (
    exploration_probability,
    most_trusted_mentor,
)
from comply_ros.learner.learner_config import HEAD_START, KernelConfig, NO_TRUST, SHAPING
from comply_ros.learner.learner_state import Advice, Array, LearnerState
from comply_ros.learner.model_exploration import model_action
from comply_ros.learner.policy_shaping import shaped_weight
from comply_ros.numerics.action_values import (
    Actions,
    count_actions,
    greedy_or_untried_action,
    max_q_except,
    NOTHING,
)
from comply_ros.numerics.jit import kernel
from comply_ros.world.grid import NO_ACTION

DRAWS = 2  # uniforms for each observation: one to listen or not, one for the own choice


@kernel
def choose(s: int, advice: Advice, step: int, u_listen: float, u_act: float,
           config: KernelConfig, state: LearnerState) -> tuple[int, float, int]:
    """
    Return the action in state s, the confidence p in the advice, and whose it is: (3.2), (3.7).

    The advice that counts (see `most_trusted_mentor`) is followed where u_listen < p. Otherwise
    the softmax (2.24) decides, or the best action and chance (epsilon-greedy); with a head start,
    an action never tried or the best one; with a model, see `model_action`; with a planner and an
    epsilon of 0, a best action.

    Parameters
    ----------
    advice: `advice[m]`, -1 for none; without any, p is 0 and the mentor -1.
    step: of the episode, from 0.
    u_listen, u_act: uniform in [0, 1).

    """
    m, p = -1, 0.0
    if config.trust != NO_TRUST:
        m, p = most_trusted_mentor(s, advice, step, config, state)
    if u_listen < p:
        return advice[m], p, m
    return own_action(s, m, advice, u_listen, u_act, config, state), p, m


@kernel
def own_action(s: int, m: int, advice: Advice, u_listen: float, u_act: float,
               config: KernelConfig, state: LearnerState) -> int:
    """Return the action in state s where the advice of mentor m (-1: none) is not followed."""
    if len(config.has_model) > 0:
        return model_action(s, advice, u_listen, u_act, config, state)
    greedy = len(config.has_planner) > 0 and config.epsilon == 0.0
    if greedy or config.trust == HEAD_START:
        explores = not greedy and u_listen >= 1.0 - exploration_probability(advice, config, state)
        return greedy_or_untried_action(
            s, explores, u_act, state.q, state.visits, config.actions)
    excluded = advice[m] if config.excludes_refused and m >= 0 else -1
    if config.epsilon > 0.0:
        return epsilon_greedy_action(
            s, excluded, u_act, config.epsilon, state.q, config.actions)
    if len(config.mentors) > 1 and config.trust == SHAPING and m >= 0:
        return shaped_action(s, excluded, u_act, advice, config, state)
    return softmax_action(s, excluded, u_act, state.temperature[0], state.q, config.actions)


@kernel
def shaped_action(s: int, excluded: int, u: float, advice: Advice, config: KernelConfig,
                  state: LearnerState) -> int:
    """
    Draw an action of state s, without the excluded one, in proportion to `shaped_weight`.

    Where no action is left that all mentors can mean, as if they had said nothing.
    """
    best, total, last = max_q_except(s, excluded, state.q, config.actions), 0.0, excluded
    if best == NOTHING:
        return excluded
    for a in range(count_actions(config.actions)):
        if a != excluded:
            total += shaped_weight(s, a, best, advice, config, state)
    if total == 0.0:
        return softmax_action(s, excluded, u, state.temperature[0], state.q, config.actions)
    x = u * total
    for a in range(count_actions(config.actions)):
        weight = 0.0 if a == excluded else shaped_weight(s, a, best, advice, config, state)
        if weight > 0.0:
            last = a
            if x < weight:
                return a
            x -= weight
    return last  # rounded, x may stay above what is left


@kernel
def policy_action(s: int, u: float, policy: Array, q: Array, actions: Actions) -> int:
    """
    Return the action of `policy[s]`; where it is -1, any action that the state has.

    u: uniform in [0, 1); the actions are equally likely.
    """
    if policy[s] >= 0:
        return policy[s]
    count = 0
    for a in range(count_actions(actions)):
        count += int(q[s, a] > NOTHING)
    pick = int(u * count)
    for a in range(count_actions(actions)):
        if q[s, a] > NOTHING:
            if pick == 0:
                return a
            pick -= 1
    return NO_ACTION


@kernel
def softmax_action(s: int, excluded: int, u: float, temperature: float, q: Array,
                   actions: Actions) -> int:
    """
    Draw an action of state s by the Gibbs softmax (2.24), without the excluded one (-1: all).

    u: uniform in [0, 1). An action that the state does not have has the value -inf and weight 0.
    A state with no other action than the excluded one gives that action.
    """
    if len(actions) != 4:
        return softmax_action_of_many(s, excluded, u, temperature, q, actions)
    q0 = NOTHING if excluded == 0 else q[s, 0]
    q1 = NOTHING if excluded == 1 else q[s, 1]
    q2 = NOTHING if excluded == 2 else q[s, 2]
    q3 = NOTHING if excluded == 3 else q[s, 3]
    best = max(q0, q1, q2, q3, NOTHING)
    if best == NOTHING:
        return excluded
    scale = 1.0 / temperature
    c0 = math.exp((q0 - best) * scale)  # 0 where there is no such action, or it is excluded
    w1 = math.exp((q1 - best) * scale)
    w2 = math.exp((q2 - best) * scale)
    w3 = math.exp((q3 - best) * scale)
    c1 = c0 + w1
    c2 = c1 + w2
    total = c2 + w3
    x = u * total
    if x >= total:  # rounded up: the last action that has a weight
        return 3 if w3 > 0.0 else 2 if w2 > 0.0 else 1 if w1 > 0.0 else 0
    return int(x >= c0) + int(x >= c1) + int(x >= c2)


@kernel
def softmax_action_of_many(s: int, excluded: int, u: float, temperature: float, q: Array,
                           actions: Actions) -> int:
    """Draw as `softmax_action` for any number of actions; weights are added in their order."""
    best, count = max_q_except(s, excluded, q, actions), count_actions(actions)
    if best == NOTHING:
        return excluded
    scale, total, last = 1.0 / temperature, 0.0, 0
    for a in range(count):
        weight = 0.0 if a == excluded else math.exp((q[s, a] - best) * scale)
        total += weight
        if weight > 0.0:
            last = a
    x, sum_so_far = u * total, 0.0
    for a in range(last):
        if a != excluded:
            sum_so_far += math.exp((q[s, a] - best) * scale)
        if x < sum_so_far:
            return a
    return last  # also where x is rounded up to the total


@kernel
def epsilon_greedy_action(s: int, excluded: int, u: float, epsilon: float, q: Array,
                          actions: Actions) -> int:
    """
    Draw any action of state s with probability epsilon, else one of the best actions.

    As in Sutton and Barto (2018), section 2.2: the best action can be drawn by chance too. The
    excluded action (-1: none) is never drawn, except in a state with no other one.

    u: uniform in [0, 1); actions of a kind are equally likely.
    """
    best, count, ties = max_q_except(s, excluded, q, actions), 0, 0
    if best == NOTHING:
        return excluded
    for a in range(count_actions(actions)):
        if a != excluded and q[s, a] > NOTHING:
            count += 1
            ties += int(q[s, a] == best)
    by_chance = u < epsilon
    pick = min(int(u / epsilon * count), count - 1) if by_chance else \
        min(int((u - epsilon) / (1.0 - epsilon) * ties), ties - 1)
    for a in range(count_actions(actions)):
        if a != excluded and (q[s, a] > NOTHING if by_chance else q[s, a] == best):
            if pick == 0:
                return a
            pick -= 1
    return excluded


@kernel
def expected_value(s: int, config: KernelConfig, state: LearnerState) -> float:
    """
    Mean value in state s of the action that an epsilon-greedy or softmax (2.24) choice draws.

    The sum of expected SARSA (Sutton and Barto, 2018, (6.9)).
    """
    best, total, weights = max_q_except(s, -1, state.q, config.actions), 0.0, 0.0
    for a in range(count_actions(config.actions)):
        q = state.q[s, a]
        if q > NOTHING:
            weight = 1.0 if config.epsilon > 0.0 else math.exp((q - best) / state.temperature[0])
            total += weight * q
            weights += weight
    mean = total / weights
    return (1.0 - config.epsilon) * best + config.epsilon * mean if config.epsilon > 0.0 else mean
