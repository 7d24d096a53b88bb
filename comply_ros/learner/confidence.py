# SPDX-License-Identifier: Apache-2.0
"""The confidence in the mentor, state by state, and what hearing its advice changes."""

import math

import numpy as np

from comply_ros.learner.baseline_trust import guided_steps, reused, shaped
from comply_ros.learner.belief_update import beta_mean, pooled_belief
from comply_ros.learner.learner_config import (
    BETA,
    EXPLICIT,
    HEAD_START,
    JUMP_START,
    SCHEDULED,
    SHAPING,
)
from comply_ros.learner.learner_state import (
    AGREED,
    CONFIDENCE,
    DISCARD,
    IN_POOL,
    LISTEN,
    MET,
    STAGE,
    TEMPERATURE,
)
from comply_ros.numerics.jit import kernel
from comply_ros.numerics.q_ops import count_untried, max_q_except


@kernel
def confidence(s, advice, step, method, q, visits, belief, arrivals, schedule):
    """
    Probability of following the mentor in state s: p of (3.2), by (3.6), (3.7) or (3.11).

    advice: the recommended action. step: of the episode, from 0.
    """
    if method.trust == SCHEDULED:
        return reused(schedule[CONFIDENCE], step, method)
    if method.trust == BETA:
        return beta_mean(belief[s, LISTEN], belief[s, DISCARD])
    if method.trust == EXPLICIT:
        temperature = listen_temperature(arrivals[s], method)
        return sigmoid((belief[s, LISTEN] - belief[s, DISCARD]) / temperature)
    if method.trust == SHAPING:
        return shaped(s, advice, schedule[CONFIDENCE], schedule[TEMPERATURE], q)
    if method.trust == JUMP_START:
        return 1.0 if step < guided_steps(schedule[STAGE], method) else 0.0
    if method.trust == HEAD_START and q[s, advice] == max_q_except(s, -1, q):
        return 1.0 - exploration_probability(advice, method, schedule) if count_untried(s, q, visits) > 0 else 1.0
    return 0.0


@kernel
def apply_advice_prior(s, advice, method, q, visits, belief, schedule):
    """
    Change what hearing advice in state s changes, before the choice; advice: -1 for none.

    A head start: the advised action begins above the others, once, and it is counted whether the
    advice is the best action here. A learned prior: the first belief in a state is the pooled one.
    """
    if advice < 0:
        return
    if method.trust == HEAD_START:
        if visits[s, advice] == 1.0:
            q[s, advice] += belief[s, LISTEN]
        belief[s, LISTEN] = 0.0
        schedule[MET] += 1.0
        if q[s, advice] == max_q_except(s, -1, q):
            schedule[AGREED] += 1.0
    elif method.learns_prior and belief[s, IN_POOL] == 0.0:
        belief[s, LISTEN], belief[s, DISCARD] = pooled_belief(method, schedule)


@kernel
def exploration_probability(advice, method, schedule):
    """Chance to try what was never tried: less, the more often the advice is the best action."""
    doubt = 1.0 - schedule[AGREED] / schedule[MET] if advice >= 0 else 1.0
    return method.exploration_probability * doubt


@kernel
def listen_temperature(arrivals, method):
    """Temperature of (3.11) in a state that was left `arrivals - 1` times before."""
    return method.listen_temperature / math.pow(arrivals, method.listen_temperature_exponent)


@kernel
def sigmoid(x):
    """Logistic function, without overflow for any x."""
    if x >= 0.0:
        return 1.0 / (1.0 + math.exp(-x))
    return math.exp(x) / (1.0 + math.exp(x))


def confidence_map(method, memory, advice):
    """
    `p[s]`, float64: at the first step in every state; 0 where nobody is trusted.

    advice: `advice[s]`, -1 where the mentor has said nothing: that matters to policy shaping and
    to a head start, which weigh the action itself.

    It is computed state by state only where it can differ from what it is in most.
    """
    numbers, advice = method.numbers(), np.asarray(advice)
    q, visits, belief, arrivals, schedule, *_ = memory.views()

    def p(s):
        return confidence(s, int(advice[s]), 0, numbers, q, visits, belief, arrivals, schedule)
    special = _special(method, memory, advice)
    usual = np.flatnonzero(~special)[:1].tolist()
    weighs_advice = method.trust in ('shaping', 'head_start')
    found = np.full(len(advice), p(usual[0]) if usual and not weighs_advice else 0.0)
    for s in np.flatnonzero(special).tolist():
        found[s] = p(s)
    return found


def _special(method, memory, advice):
    """`special[s]`, bool: where the confidence can be another one than in all other states."""
    if method.trust in ('shaping', 'head_start'):
        return advice >= 0
    if method.trust in ('beta', 'explicit'):
        belief = memory.belief
        return ((belief[:, LISTEN] != method.belief_listen)
                | (belief[:, DISCARD] != method.belief_discard)
                | (memory.arrivals != 1.0))
    return np.zeros(len(advice), dtype=bool)
