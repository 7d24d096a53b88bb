# SPDX-License-Identifier: Apache-2.0
"""SARSA and Q-learning updates of one transition, and the decay of temperature and trust."""

import math

from comply_ros.learner.action_choice import expected_value
from comply_ros.learner.belief_update import update_belief
from comply_ros.learner.eligibility_traces import mark_trace, propagate_along_traces
from comply_ros.learner.learner_config import BETA, EXPLICIT, KernelConfig
from comply_ros.learner.learner_state import Advice, LearnerState
from comply_ros.learner.outcome_model import learn_outcome
from comply_ros.learner.policy_shaping import record_consistency
from comply_ros.learner.prioritized_sweeping import learn_and_sweep
from comply_ros.learner.usual_outcome_model import backup, mark_visited, record_outcome
from comply_ros.numerics.action_values import count_actions, max_q_except, NOTHING
from comply_ros.numerics.jit import kernel


@kernel
def learn(s: int, a: int, r: float, s2: int, a2: int, done: bool, advice: Advice, u: float,
          config: KernelConfig, state: LearnerState) -> None:
    """
    Change all arrays by one transition: SARSA (2.15), Q-learning (2.17), compliance (3.3).

    With a model, see `learn_outcome`; with a planner, `learn_and_sweep`; where the consistency of
    mentors is estimated, `record_consistency`.

    Parameters
    ----------
    done: s2 is terminal and has the value 0.
    advice: `advice[m]`, the action of each mentor in s, -1 for none.
    u: uniform in [0, 1): which of two tables learns, or the seed of what PSRL draws.

    """
    state.departures[s] += 1.0
    if len(config.has_model) > 0:
        learn_outcome(s, a, r, s2, done, config, state)
        return
    if len(config.has_planner) > 0:
        learn_and_sweep(s, a, r, s2, done, u, config, state)
        return
    if config.doubles:
        learn_double(s, a, r, s2, done, u < 0.5, config, state)
        return
    if len(config.has_estimates) > 0:
        record_consistency(s, advice, config, state)
    q, visits = state.q, state.visits
    target, trace_factor = r, 1.0
    if not done:
        following = q[s2, a2]
        if config.off_policy:
            best = max_q_except(s2, -1, q, config.actions)
            if following < best and config.cuts_traces:
                trace_factor = 0.0
            following = best
        elif config.expects:
            following = expected_value(s2, config, state)
        target += config.discount * following
    if config.trust == BETA:
        for m in range(len(config.mentors)):
            if advice[m] >= 0:
                update_belief(s, a, m, advice[m], target - q[s, advice[m]], config, state)
    change = learning_rate(visits[s, a], config) * (target - q[s, a])
    if config.replays:
        record_outcome(s, a, r, s2, done, visits[s, a], state.outcomes)
        mark_visited(s, state.traces, state.trail, config.actions)
    elif config.trace_decay > 0.0:
        mark_trace(s, a, config, state.traces, state.trail)
        decay = trace_factor * config.discount * config.trace_decay
        propagate_along_traces(change, decay, config.trace_floor, q, state.traces, state.trail,
                               config.actions)
    else:
        q[s, a] += change
    visits[s, a] += config.visit_growth
    if config.replays:
        backup(s, config.discount, q, visits, state.outcomes, config.actions)
    if config.trust == EXPLICIT:
        for m in range(len(config.mentors)):
            if advice[m] >= 0:
                update_belief(s, a, m, advice[m], 0.0, config, state)


@kernel
def learn_double(s: int, a: int, r: float, s2: int, done: bool, first: bool,
                 config: KernelConfig, state: LearnerState) -> None:
    """
    Change one of two tables of values by a transition: double Q-learning (van Hasselt, 2010).

    first: whether the first one learns, from the value of the second one; else the other way.
    Ties of the best action go to the lower number.
    """
    q, sign = state.q, 1.0 if first else -1.0
    half, target = state.half_difference, r
    if not done:
        best, following = NOTHING, 0.0
        for b in range(count_actions(config.actions)):
            value = q[s2, b] + sign * half[s2, b]
            if value > best:
                best, following = value, q[s2, b] - sign * half[s2, b]
        target += config.discount * following
    change = learning_rate(state.visits[s, a], config) * (target - (q[s, a] + sign * half[s, a]))
    q[s, a] += 0.5 * change
    half[s, a] += sign * 0.5 * change
    state.visits[s, a] += config.visit_growth


@kernel
def learning_rate(c: float, config: KernelConfig) -> float:
    """Learning rate of a state and action with visit count c, from 1 upwards (2.26)."""
    if config.learning_rate_exponent == 1.0:
        return config.learning_rate / c  # the same bits as with pow, and faster
    return config.learning_rate / math.pow(c, config.learning_rate_exponent)


@kernel
def decay_schedules(mean_return: float, config: KernelConfig, state: LearnerState) -> None:
    """Change confidence (3.6), temperature (2.25) and the other schedules after an iteration."""
    state.scheduled_confidence[0] *= config.confidence_factor
    if state.scheduled_confidence[0] <= config.cooling_confidence:
        cooler = state.temperature[0] * config.temperature_factor
        state.temperature[0] = max(cooler, config.temperature_floor)
    state.trust_rate[0] *= config.trust_rate_factor
    best = state.best_return[0]
    if best == -math.inf or mean_return >= best - config.guided_tolerance * abs(best):
        state.guided_stage[0] += 1.0
    state.best_return[0] = max(best, mean_return)
