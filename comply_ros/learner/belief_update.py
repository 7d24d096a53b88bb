# SPDX-License-Identifier: Apache-2.0
"""What a step teaches about the mentor: the Beta belief, the values of listening, their pool."""

from comply_ros.learner.learner_config import BETA, EXPLICIT
from comply_ros.learner.learner_state import (
    DISCARD,
    IN_POOL,
    LISTEN,
    POOLED,
    POOLED_DISCARD,
    POOLED_LISTEN,
    TRUST_RATE,
)
from comply_ros.numerics.jit import kernel
from comply_ros.numerics.q_ops import max_q_except, NOTHING


@kernel
def update_belief(s, a, advice, delta, method, q, belief, schedule):
    """
    Change belief[s] and the pool after a step with action a in state s: (4.2), (3.12).

    advice: the mentor's action in s. delta: what the step earned beyond q[s, advice] (3.8), taken
    before q was updated; q is the updated one.
    """
    if method.trust != BETA and method.trust != EXPLICIT:
        return
    listen, discard = belief[s, LISTEN], belief[s, DISCARD]
    if method.trust == BETA:
        update_beta(s, a == advice, delta, schedule[TRUST_RATE], method, belief)
    else:
        update_listening_values(s, a, advice, method, q, belief)
    if belief[s, IN_POOL] == 0.0:  # all of its belief is new to the pool
        belief[s, IN_POOL] = 1.0
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
        best = max_q_except(s, advice, q)
        if best > NOTHING:  # a dead end has no other action
            belief[s, DISCARD] = old * belief[s, DISCARD] + new * best


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
