# SPDX-License-Identifier: Apache-2.0
"""The confidence in the mentor, state by state, and what a step teaches about it."""

import math

from comply_ros.core.compiled import kernel
from comply_ros.core.memory import (
    AGREED,
    CONFIDENCE,
    DISCARD,
    LISTEN,
    MET,
    POOLED,
    POOLED_DISCARD,
    POOLED_LISTEN,
    STAGE,
    TEMPERATURE,
    TRUST_RATE,
)
from comply_ros.core.method import BETA, EXPLICIT, HEAD_START, JUMP_START, SCHEDULED, SHAPING

NOTHING = -1e308  # below every action value of an action that the cell has


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
    if method.trust == HEAD_START and q[s, advice] == highest_but(s, -1, q):
        return 1.0 - curiosity(advice, method, schedule) if untried(s, q, visits) > 0 else 1.0
    return 0.0


@kernel
def heed(s, advice, method, q, visits, belief, arrivals, schedule):
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
        if q[s, advice] == highest_but(s, -1, q):
            schedule[AGREED] += 1.0
    elif method.learns_prior and arrivals[s] == 1.0:
        belief[s, LISTEN], belief[s, DISCARD] = pooled_belief(method, schedule)


@kernel
def curiosity(advice, method, schedule):
    """Chance to try what was never tried: less, the more often the advice is the best action."""
    doubt = 1.0 - schedule[AGREED] / schedule[MET] if advice >= 0 else 1.0
    return method.curiosity * doubt


@kernel
def untried(s, q, visits):
    """How many actions of state s were never tried."""
    count = 0
    for a in range(4):
        count += int(q[s, a] > NOTHING and visits[s, a] == 1.0)
    return count


@kernel
def pooled_belief(method, schedule):
    """
    First belief in a state by all others: as sure as the prior, and as much on one side as they.

    Empirical Bayes (section 5.3): the mean over the states left and the prior itself.
    """
    listen = schedule[POOLED_LISTEN] / schedule[POOLED]
    discard = schedule[POOLED_DISCARD] / schedule[POOLED]
    if method.trust != BETA:
        return listen, discard
    share = beta_mean(listen, discard)
    strength = method.belief_listen + method.belief_discard
    return strength * share, strength * (1.0 - share)


@kernel
def update_belief(s, a, advice, delta, method, q, belief, arrivals, schedule):
    """
    Change belief[s] after the step in which action a was taken in state s: (4.2), (3.12).

    advice: the mentor's action in s. delta: what the step earned beyond q[s, advice] (3.8), taken
    before q was updated; q is the updated one. arrivals: with this step.
    """
    if method.trust != BETA and method.trust != EXPLICIT:
        return
    listen, discard = belief[s, LISTEN], belief[s, DISCARD]
    if method.trust == BETA:
        update_beta(s, a == advice, delta, schedule[TRUST_RATE], method, belief)
    else:
        update_listening_values(s, a, advice, method, q, belief)
    if arrivals[s] == 2.0:  # left for the first time: all of its belief is new to the pool
        schedule[POOLED] += 1.0
        listen, discard = 0.0, 0.0
    schedule[POOLED_LISTEN] += belief[s, LISTEN] - listen
    schedule[POOLED_DISCARD] += belief[s, DISCARD] - discard


@kernel
def beta_mean(alpha, beta):
    """
    Mean of Beta(alpha, beta), the p that is used in practice (section 4.1.1).

    The published runs cut alpha and beta at 0, and the text's (4.2) can lead below. No alpha is no
    reason to follow, p is 0, also where nothing is left of either; no beta is none to refuse.
    """
    if alpha <= 0.0:
        return 0.0
    if beta <= 0.0:
        return 1.0
    return alpha / (alpha + beta)


@kernel
def update_beta(s, listened, delta, rate, method, belief):
    """
    Change belief[s]: alpha where the mentor's action was taken, beta where not (4.2).

    rate: the gamma of (4.2). A belief of which nothing is left, alpha + beta <= 0, stays as it is.
    """
    alpha, beta = belief[s, LISTEN], belief[s, DISCARD]
    if alpha + beta <= 0.0:
        return
    if method.sign_only:
        delta = 1.0 if delta > 0.0 else -1.0 if delta < 0.0 else 0.0
    if listened:
        alpha += rate * beta / (alpha + beta) * delta
    else:
        beta += rate * alpha / (alpha + beta) * delta
    if method.bounded_belief:
        alpha, beta = max(alpha, 0.0), max(beta, 0.0)
    belief[s, LISTEN], belief[s, DISCARD] = alpha, beta


@kernel
def update_listening_values(s, a, advice, method, q, belief):
    """Change belief[s]: the values of listening and of discarding (3.12)."""
    old, new = 1.0 - method.trust_rate, method.trust_rate
    if a == advice or method.updates_both:
        belief[s, LISTEN] = old * belief[s, LISTEN] + new * q[s, advice]
    if a != advice or method.updates_both:
        best = highest_but(s, advice, q)
        if best > NOTHING:  # a dead end has no other action
            belief[s, DISCARD] = old * belief[s, DISCARD] + new * best


@kernel
def highest_but(s, excluded, q):
    """Highest action value in state s without the excluded action, or NOTHING: (2.17), (3.12)."""
    best = NOTHING
    for a in range(4):
        value = q[s, a] if a != excluded else NOTHING
        best = value if value > best else best
    return best


@kernel
def listen_temperature(arrivals, method):
    """Temperature of (3.11) in a state that was left `arrivals - 1` times before."""
    return method.listen_temperature / math.pow(arrivals, method.listen_temperature_exponent)


@kernel
def reused(p, step, method):
    """Return p after `step` steps of an episode: policy reuse (methods.py, `pi_reuse`)."""
    if method.reuse_factor == 1.0:
        return p
    return p * math.pow(method.reuse_factor, float(step))  # compiled, a whole power has other bits


@kernel
def shaped(s, advice, consistency, temperature, q):
    """
    Probability of the advice where it is multiplied into the softmax (2.24): policy shaping.

    consistency: how often advice is right, C; one opinion for the action makes its odds C / (1-C)
    times as high (methods.py, `policy_shaping`).
    """
    best, others = highest_but(s, -1, q), 0.0
    for a in range(4):
        if a != advice:
            others += math.exp((q[s, a] - best) / temperature)
    right = consistency * math.exp((q[s, advice] - best) / temperature)
    wrong = (1.0 - consistency) * others
    return right / (right + wrong) if right > 0.0 else 0.0


@kernel
def guided_steps(stage, method):
    """First steps of an episode in which a jump start is led, after `stage` shortenings."""
    return method.guided_steps * max(0.0, 1.0 - stage / method.guided_stages)


@kernel
def sigmoid(x):
    """Logistic function, without overflow for any x."""
    if x >= 0.0:
        return 1.0 / (1.0 + math.exp(-x))
    return math.exp(x) / (1.0 + math.exp(x))


def confidences(method, memory, advice):
    """
    `p[s]` at the first step in every state: list of floats; 0 where nobody is trusted.

    advice: `advice[s]`, -1 where the mentor has said nothing: that matters to policy shaping and
    to a head start, which weigh the action itself.
    """
    numbers = method.numbers()
    q, visits, belief, arrivals, schedule, *_ = memory.views()
    silent = method.trust in ('shaping', 'head_start')
    return [confidence(s, said, 0, numbers, q, visits, belief, arrivals, schedule)
            if said >= 0 or not silent else 0.0 for s, said in enumerate(advice)]
