# SPDX-License-Identifier: Apache-2.0
"""Confidence in mentors: the probability of following their advice, and whose counts."""

import math
from typing import Any

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
    RETURNS,
    SCHEDULED,
    SHAPING,
    TRACK_RECORD,
)
from comply_ros.learner.learner_state import Advice, DISCARD, IN_POOL, LearnerState, LISTEN
from comply_ros.learner.mentor_of_episode import best_followed
from comply_ros.learner.mentor_records import hear_advice
from comply_ros.learner.model_exploration import following_probability
from comply_ros.learner.policy_shaping import policy_shaping_confidence
from comply_ros.numerics.action_values import count_untried, max_q_except
from comply_ros.numerics.jit import kernel


@kernel
def confidence(s: int, m: int, advice: Advice, step: int, config: KernelConfig,
               state: LearnerState) -> float:
    """
    Probability of following mentor m in state s: p of (3.2), by (3.6), (3.7) or (3.11).

    advice: `advice[k]`, the recommended action of each mentor, -1 for none; that of m is one.
    step: of the episode, from 0.
    """
    row = m * len(state.departures) + s
    if config.trust == SCHEDULED:
        return policy_reuse_confidence(state.scheduled_confidence[0], step, config)
    if config.trust == BETA:
        return beta_mean(state.belief[row, LISTEN], state.belief[row, DISCARD])
    if config.trust == EXPLICIT:
        temperature = listen_temperature(state.departures[s], config)
        return sigmoid((state.belief[row, LISTEN] - state.belief[row, DISCARD]) / temperature)
    if config.trust == SHAPING:
        return policy_shaping_confidence(s, advice[m], advice, config, state)
    if config.trust == JUMP_START:
        return 1.0 if step < guided_steps(state.guided_stage[0], config) else 0.0
    if config.trust == RETURNS:
        return 1.0 if m == state.followed_mentor[0] else 0.0
    if config.trust == HEAD_START and (
            state.q[s, advice[m]] == max_q_except(s, -1, state.q, config.actions)):
        if count_untried(s, state.q, state.visits, config.actions) > 0:
            return 1.0 - exploration_probability(advice, config, state)
        return 1.0
    if len(config.has_model) > 0 and config.trust == TRACK_RECORD:
        return following_probability(s, m, advice, config, state)
    return 0.0


@kernel
def most_trusted_mentor(s: int, advice: Advice, step: int, config: KernelConfig,
                        state: LearnerState) -> tuple[int, float]:
    """
    Return the mentor whose advice counts in state s, -1 for none, and the confidence in it.

    The one with the highest confidence; of several, the one with the best record where records
    are kept, then the one whose advice has the highest action value, then that with the most
    mentors behind it, then the first. In a majority vote, only those with the most mentors behind
    them count. With several mentors, `state.confidences` changes.
    """
    if len(config.mentors) == 1:
        return (0, confidence(s, 0, advice, step, config, state)) if advice[0] >= 0 else (-1, 0.0)
    chosen, highest, most = -1, 0.0, 0
    for m in range(len(config.mentors)):
        state.confidences[m] = 0.0
        if advice[m] >= 0:
            p = confidence(s, m, advice, step, config, state)
            state.confidences[m] = p
            votes = count_votes(advice[m], advice, config) if config.follows_majority else 0
            if chosen < 0 or votes > most or votes == most and (p > highest or (
                    p == highest and _ranks_above(s, m, chosen, advice, config, state))):
                chosen, highest, most = m, p, votes
    return chosen, highest


@kernel
def _ranks_above(s: int, m: int, other: int, advice: Advice, config: KernelConfig,
                 state: LearnerState) -> bool:
    """Whether mentor m counts before another one in which the confidence is the same."""
    if (config.trust == HEAD_START or config.trust == TRACK_RECORD
            or len(config.has_estimates) > 0):
        here = state.advice_agreed[m] / state.advice_seen[m]
        there = state.advice_agreed[other] / state.advice_seen[other]
        if here != there:
            return here > there
    if state.q[s, advice[m]] != state.q[s, advice[other]]:
        return state.q[s, advice[m]] > state.q[s, advice[other]]
    return count_votes(advice[m], advice, config) > count_votes(advice[other], advice, config)


@kernel
def count_votes(a: int, advice: Advice, config: KernelConfig) -> int:
    """Return the number of mentors that recommend an action."""
    votes = 0
    for m in range(len(config.mentors)):
        votes += int(advice[m] == a)
    return votes


@kernel
def apply_advice_prior(s: int, advice: Advice, config: KernelConfig, state: LearnerState) -> None:
    """
    Change what advice in state s changes before the choice; advice: `advice[m]`, -1 for none.

    Head start: the advised action starts above the others, once, and it is counted whether the
    advice is the best action here. Learned prior: the first belief in a state is the pooled one.
    Track record: see `hear_advice`.
    """
    if len(config.has_model) > 0:
        hear_advice(s, advice, config, state)
        return
    if config.trust == HEAD_START:
        raise_advised_values(s, advice, config, state)
    elif config.learns_prior:
        for m in range(len(config.mentors)):
            row = m * len(state.departures) + s
            if advice[m] >= 0 and state.belief[row, IN_POOL] == 0.0:
                state.belief[row, LISTEN], state.belief[row, DISCARD] = pooled_belief(
                    m, config, state)


@kernel
def raise_advised_values(s: int, advice: Advice, config: KernelConfig,
                         state: LearnerState) -> None:
    """
    Change the values of actions advised in state s, once each, then the counts of best advice.

    advice: `advice[m]`, -1 for none.
    """
    for m in range(len(config.mentors)):
        if advice[m] >= 0:
            row = m * len(state.departures) + s
            if state.visits[s, advice[m]] == 1.0:
                state.q[s, advice[m]] += state.belief[row, LISTEN]
            state.belief[row, LISTEN] = 0.0
    best = max_q_except(s, -1, state.q, config.actions)
    for m in range(len(config.mentors)):
        if advice[m] >= 0:
            state.advice_seen[m] += 1.0
            if state.q[s, advice[m]] == best:
                state.advice_agreed[m] += 1.0


@kernel
def exploration_probability(advice: Advice, config: KernelConfig, state: LearnerState) -> float:
    """Probability of trying an untried action: lower, the more often the advice is the best."""
    doubt = 1.0
    for m in range(len(config.mentors)):
        if advice[m] >= 0:
            doubt *= 1.0 - state.advice_agreed[m] / state.advice_seen[m]
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
def guided_steps(stage: float, config: KernelConfig) -> float:
    """Return the number of first steps that a jump start guides, after `stage` shortenings."""
    return config.guided_steps * max(0.0, 1.0 - stage / config.guided_stages)


def confidence_map(config: LearnerConfig, state: LearnerState,
                   advice: ArrayLike) -> NDArray[np.float64]:
    """
    `p[s]` at the first step in every state; 0 where there is nobody to trust.

    Of several mentors in rows, `p[m * n_states + s]`, as their advice. It is computed state by
    state only where it can differ from that of most states.

    advice: `advice[s]`, -1 where the mentor has not recommended anything. Policy shaping, head
        start and track records weigh the action itself.

    """
    states = len(state.departures)
    state = best_followed(state) if config.trust == 'returns' else state
    advice = np.asarray(advice).reshape(-1, states)
    kernel_config, views = config.for_kernels(state.q.shape[1], len(advice)), state.views()
    weighs_action = config.trust in ('shaping', 'head_start', 'track_record')
    found = np.zeros(advice.shape)
    for m, of_mentor in enumerate(advice):
        if weighs_action:
            special = of_mentor >= 0
        elif config.trust in ('beta', 'explicit'):
            belief = state.belief[m * states:(m + 1) * states]
            special = ((belief[:, LISTEN] != config.belief_listen)
                       | (belief[:, DISCARD] != config.belief_discard)
                       | (state.departures != 1.0))
        else:
            special = np.zeros(states, dtype=bool)

        def p(s: int) -> float:
            return confidence(s, m, advice[:, s].tolist(), 0, kernel_config, views)
        usual = np.flatnonzero(~special)[:1].tolist()
        if usual and not weighs_action:
            found[m] = p(usual[0])
        for s in np.flatnonzero(special).tolist():
            found[m, s] = p(s)
    return found.ravel()


def trusted_advice(config: LearnerConfig, state: LearnerState, advice: NDArray[Any],
                   confidences: NDArray[np.float64],
                   ) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """
    Return `advice[s]` of the mentor that counts in each state, and `p[s]`, the confidence in it.

    As `most_trusted_mentor`. advice, confidences: of one or several mentors, in rows.
    """
    states = len(state.departures)
    rows, p = advice.reshape(-1, states), confidences.reshape(-1, states)
    if len(rows) == 1:
        return advice, confidences
    kernel_config = config.for_kernels(state.q.shape[1], len(rows))
    state = best_followed(state) if config.trust == 'returns' else state
    views = state._replace(confidences=np.zeros(len(rows))).views()  # those of the learner stay
    chosen = np.zeros(states, dtype=np.int64)
    for s in np.flatnonzero((rows >= 0).any(axis=0)).tolist():
        chosen[s], _ = most_trusted_mentor(s, rows[:, s].tolist(), 0, kernel_config, views)
    every = np.arange(states)
    return rows[chosen, every], p[chosen, every]
