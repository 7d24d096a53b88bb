# SPDX-License-Identifier: Apache-2.0
"""Confidence in the mentor: the probability of following its advice in a state."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comply_ros.learner.belief_update import beta_mean, pooled_belief
from comply_ros.learner.learner_config import (
    BETA,
    EXPLICIT,
    HEAD_START,
    JUMP_START,
    KernelConfig,
    LearnerConfig,
    SCHEDULED,
    SHAPING,
    TRACK_RECORD,
)
from comply_ros.learner.learner_state import Array, DISCARD, IN_POOL, LearnerState, LISTEN
from comply_ros.learner.model_exploration import following_probability
from comply_ros.learner.track_record import hear_advice
from comply_ros.numerics.action_values import Actions, count_actions, count_untried, max_q_except
from comply_ros.numerics.jit import kernel


@kernel
def confidence(s: int, advice: int, step: int, config: KernelConfig, state: LearnerState) -> float:
    """
    Probability of following the mentor in state s: p of (3.2), by (3.6), (3.7) or (3.11).

    advice: the recommended action. step: of the episode, from 0.
    """
    if config.trust == SCHEDULED:
        return policy_reuse_confidence(state.scheduled_confidence[0], step, config)
    if config.trust == BETA:
        return beta_mean(state.belief[s, LISTEN], state.belief[s, DISCARD])
    if config.trust == EXPLICIT:
        temperature = listen_temperature(state.departures[s], config)
        return sigmoid((state.belief[s, LISTEN] - state.belief[s, DISCARD]) / temperature)
    if config.trust == SHAPING:
        return policy_shaping_confidence(s, advice, state.scheduled_confidence[0],
                                         state.temperature[0], state.q, config.actions)
    if config.trust == JUMP_START:
        return 1.0 if step < guided_steps(state.guided_stage[0], config) else 0.0
    if config.trust == HEAD_START and (
            state.q[s, advice] == max_q_except(s, -1, state.q, config.actions)):
        if count_untried(s, state.q, state.visits, config.actions) > 0:
            return 1.0 - exploration_probability(advice, config, state)
        return 1.0
    if len(config.has_model) > 0 and config.trust == TRACK_RECORD:
        return following_probability(s, advice, config, state)
    return 0.0


@kernel
def apply_advice_prior(s: int, advice: int, config: KernelConfig, state: LearnerState) -> None:
    """
    Change what advice in state s changes before the choice; advice: -1 for none.

    Head start: the advised action starts above the others, once, and it is counted whether the
    advice is the best action here. Learned prior: the first belief in a state is the pooled one.
    Track record: see `hear_advice`.
    """
    if len(config.has_model) > 0:
        hear_advice(s, advice if config.trust == TRACK_RECORD else -1, config, state)
        return
    if advice < 0:
        return
    if config.trust == HEAD_START:
        if state.visits[s, advice] == 1.0:
            state.q[s, advice] += state.belief[s, LISTEN]
        state.belief[s, LISTEN] = 0.0
        state.advice_seen[0] += 1.0
        if state.q[s, advice] == max_q_except(s, -1, state.q, config.actions):
            state.advice_agreed[0] += 1.0
    elif config.learns_prior and state.belief[s, IN_POOL] == 0.0:
        state.belief[s, LISTEN], state.belief[s, DISCARD] = pooled_belief(config, state)


@kernel
def exploration_probability(advice: int, config: KernelConfig, state: LearnerState) -> float:
    """Probability of trying an untried action: lower, the more often the advice is the best."""
    doubt = 1.0 - state.advice_agreed[0] / state.advice_seen[0] if advice >= 0 else 1.0
    return config.exploration_probability * doubt


@kernel
def listen_temperature(departures: float, config: KernelConfig) -> float:
    """Temperature of (3.11) in a state that was left `departures - 1` times before."""
    return config.listen_temperature / math.pow(departures, config.listen_temperature_exponent)


@kernel
def sigmoid(x: float) -> float:
    """Logistic function, without overflow for any x."""
    if x >= 0.0:
        return 1.0 / (1.0 + math.exp(-x))
    return math.exp(x) / (1.0 + math.exp(x))


@kernel
def policy_reuse_confidence(p: float, step: int, config: KernelConfig) -> float:
    """Confidence p after `step` steps of an episode (preset `pi_reuse`)."""
    if config.reuse_factor == 1.0:
        return p
    return p * math.pow(config.reuse_factor, float(step))  # compiled, an int power has other bits


@kernel
def policy_shaping_confidence(s: int, advice: int, consistency: float, temperature: float,
                              q: Array, actions: Actions) -> float:
    """
    Probability of the advice where it multiplies the softmax (2.24) (preset `policy_shaping`).

    consistency: the share C of right advice; it makes the odds of the action C / (1 - C) times
    as high.
    """
    best, others = max_q_except(s, -1, q, actions), 0.0
    for a in range(count_actions(actions)):
        if a != advice:
            others += math.exp((q[s, a] - best) / temperature)
    right = consistency * math.exp((q[s, advice] - best) / temperature)
    wrong = (1.0 - consistency) * others
    return right / (right + wrong) if right > 0.0 else 0.0


@kernel
def guided_steps(stage: float, config: KernelConfig) -> float:
    """Return the number of first steps that a jump start guides, after `stage` shortenings."""
    return config.guided_steps * max(0.0, 1.0 - stage / config.guided_stages)


def confidence_map(config: LearnerConfig, state: LearnerState,
                   advice: ArrayLike) -> NDArray[np.float64]:
    """
    `p[s]` at the first step in every state; 0 where there is nobody to trust.

    It is computed state by state only where it can differ from that of most states.

    advice: `advice[s]`, -1 where the mentor has not recommended anything. Policy shaping and head
        start weigh the action itself.

    """
    kernel_config, views = config.for_kernels(state.q.shape[1]), state.views()
    advice = np.asarray(advice)
    weighs_action = config.trust in ('shaping', 'head_start', 'track_record')
    if weighs_action:
        special = advice >= 0
    elif config.trust in ('beta', 'explicit'):
        special = ((state.belief[:, LISTEN] != config.belief_listen)
                   | (state.belief[:, DISCARD] != config.belief_discard)
                   | (state.departures != 1.0))
    else:
        special = np.zeros(len(advice), dtype=bool)

    def p(s: int) -> float:
        return confidence(s, int(advice[s]), 0, kernel_config, views)
    usual = np.flatnonzero(~special)[:1].tolist()
    found = np.full(len(advice), p(usual[0]) if usual and not weighs_action else 0.0)
    for s in np.flatnonzero(special).tolist():
        found[s] = p(s)
    return found
