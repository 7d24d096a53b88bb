# SPDX-License-Identifier: Apache-2.0
"""The confidence in the mentor, state by state, and what a step teaches about it."""

import math

from comply_ros.core.compiled import kernel
from comply_ros.core.memory import CONFIDENCE, DISCARD, LISTEN
from comply_ros.core.method import BETA, EXPLICIT, SCHEDULED

NOTHING = -1e308  # below every action value of an action that the cell has


@kernel
def confidence(s, method, belief, arrivals, schedule):
    """Probability of following the mentor in state s: p of (3.2), by (3.6), (3.7) or (3.11)."""
    if method.trust == SCHEDULED:
        return schedule[CONFIDENCE]
    if method.trust == BETA:
        return beta_mean(belief[s, LISTEN], belief[s, DISCARD])
    if method.trust == EXPLICIT:
        temperature = listen_temperature(arrivals[s], method)
        return sigmoid((belief[s, LISTEN] - belief[s, DISCARD]) / temperature)
    return 0.0


@kernel
def update_belief(s, a, advice, delta, method, q, belief):
    """
    Change belief[s] after the step in which action a was taken in state s: (4.2), (3.12).

    advice: the mentor's action in s. delta: what the step earned beyond q[s, advice] (3.8), taken
    before q was updated; q is the updated one.
    """
    if method.trust == BETA:
        update_beta(s, a == advice, delta, method, belief)
    elif method.trust == EXPLICIT:
        update_listening_values(s, a, advice, method, q, belief)


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
def update_beta(s, listened, delta, method, belief):
    """
    Change belief[s]: alpha where the mentor's action was taken, beta where not (4.2).

    A belief of which nothing is left, alpha + beta <= 0, stays as it is.
    """
    alpha, beta = belief[s, LISTEN], belief[s, DISCARD]
    if alpha + beta <= 0.0:
        return
    if method.sign_only:
        delta = 1.0 if delta > 0.0 else -1.0 if delta < 0.0 else 0.0
    if listened:
        alpha += method.trust_rate * beta / (alpha + beta) * delta
    else:
        beta += method.trust_rate * alpha / (alpha + beta) * delta
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
def sigmoid(x):
    """Logistic function, without overflow for any x."""
    if x >= 0.0:
        return 1.0 / (1.0 + math.exp(-x))
    return math.exp(x) / (1.0 + math.exp(x))


def confidences(method, memory):
    """`p[s]` in every state: list of floats; 0 where nobody is trusted."""
    numbers, (_, _, belief, arrivals, schedule) = method.numbers(), memory.views()
    return [confidence(s, numbers, belief, arrivals, schedule) for s in range(len(arrivals))]
