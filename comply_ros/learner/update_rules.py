# SPDX-License-Identifier: Apache-2.0
"""One step of every learner: `choose` the next action, then `learn` from the last."""

import math

from comply_ros.learner.belief_update import update_belief
from comply_ros.learner.confidence import confidence, exploration_probability
from comply_ros.learner.eligibility_traces import mark_trace, propagate_along_traces
from comply_ros.learner.learner_config import HEAD_START, NO_TRUST
from comply_ros.learner.learner_state import (
    BEST_RETURN,
    CONFIDENCE,
    STAGE,
    TEMPERATURE,
    TRUST_RATE,
)
from comply_ros.learner.model import backup, mark_visited, record_outcome
from comply_ros.numerics.jit import kernel
from comply_ros.numerics.q_ops import count_untried, max_q_except, NOTHING
from comply_ros.world.grid import NO_ACTION

DRAWS = 2  # uniforms per state met: one to listen or not, one for the own choice


@kernel
def choose(s, advice, step, u_listen, u_act, method,
           q, visits, belief, arrivals, schedule, traces, trail, outcomes):
    """
    Return the action in state s, and the p with which advice was weighed: (3.2), (3.7).

    advice: the mentor's action, -1 for none (then p is 0). step: of the episode, from 0.
    u_listen, u_act: uniform in [0, 1). The advice is followed where u_listen < p; otherwise the
    softmax of (2.24) decides, or curiosity where advice is a head start.
    """
    p = 0.0
    if advice >= 0 and method.trust != NO_TRUST:
        p = confidence(s, advice, step, method, q, visits, belief, arrivals, schedule)
    if u_listen < p:
        return advice, p
    if method.trust == HEAD_START:
        tries = u_listen >= 1.0 - exploration_probability(advice, method, schedule)
        return greedy_or_untried_action(s, tries, u_act, q, visits), p
    excluded = advice if method.excludes_refused and method.trust != NO_TRUST else -1
    return softmax_action(s, excluded, u_act, schedule[TEMPERATURE], q), p


@kernel
def learn(s, a, r, s2, a2, done, advice, method,
          q, visits, belief, arrivals, schedule, traces, trail, outcomes):
    """
    Change all arrays by one transition: (2.15), (2.17), (2.26), (3.3).

    done: s2 is terminal and worth nothing. advice: what the mentor said in s, -1 for nothing.
    """
    target, goes_on = r, 1.0
    if not done:
        following = q[s2, a2]
        if method.off_policy:
            best = max_q_except(s2, -1, q)
            if following < best and method.cuts_traces:
                goes_on = 0.0
            following = best
        target += method.discount * following
    delta = target - q[s, advice] if advice >= 0 else 0.0
    change = learning_rate(visits[s, a], method) * (target - q[s, a])
    if method.replays:
        record_outcome(s, a, r, s2, done, visits[s, a], outcomes)
        mark_visited(s, traces, trail)
    elif method.trace_decay > 0.0:
        mark_trace(s, a, method, traces, trail)
        fades = goes_on * method.discount * method.trace_decay
        propagate_along_traces(change, fades, method.trace_floor, q, traces, trail)
    else:
        q[s, a] += change
    visits[s, a] += method.visit_growth
    arrivals[s] += 1.0
    if method.replays:
        backup(s, method.discount, q, visits, outcomes)
    if advice >= 0:
        update_belief(s, a, advice, delta, method, q, belief, schedule)


@kernel
def learning_rate(c, method):
    """Learning rate of a state and action with visit count c, from 1 upwards (2.26)."""
    if method.learning_rate_exponent == 1.0:
        return method.learning_rate / c  # the same bits as with pow, sooner
    return method.learning_rate / math.pow(c, method.learning_rate_exponent)


@kernel
def decay_schedules(mean_return, method, schedule):
    """Change schedule after an iteration: confidence (3.6), temperature (2.25), the rest."""
    schedule[CONFIDENCE] *= method.confidence_factor
    if schedule[CONFIDENCE] <= method.cooling_confidence:
        cooler = schedule[TEMPERATURE] * method.temperature_factor
        schedule[TEMPERATURE] = max(cooler, method.temperature_floor)
    schedule[TRUST_RATE] *= method.trust_rate_factor
    best = schedule[BEST_RETURN]
    if best == -math.inf or mean_return >= best - method.guided_tolerance * abs(best):
        schedule[STAGE] += 1.0
    schedule[BEST_RETURN] = max(best, mean_return)


@kernel
def softmax_action(s, excluded, u, temperature, q):
    """
    Draw an action in state s by the Gibbs softmax (2.24), without the excluded one (-1: all).

    u: uniform in [0, 1). An action that the cell does not have is worth -inf and has weight 0. In
    a cell with nothing but the excluded action, that action.
    """
    best = max_q_except(s, excluded, q)
    if best == NOTHING:
        return excluded
    scale = 1.0 / temperature
    return drawn(u, weight(s, 0, excluded, best, scale, q),
                 weight(s, 1, excluded, best, scale, q),
                 weight(s, 2, excluded, best, scale, q),
                 weight(s, 3, excluded, best, scale, q))


@kernel
def greedy_or_untried_action(s, tries, u, q, visits):
    """
    Draw an action of state s that was never tried if one is to be tried, else a best one.

    u: uniform in [0, 1); equally likely among them.
    """
    best, unknown, ties = max_q_except(s, -1, q), count_untried(s, q, visits), 0
    for a in range(4):
        ties += int(q[s, a] == best)
    tries = tries and unknown > 0
    pick = int(u * (unknown if tries else ties))
    for a in range(4):
        if (q[s, a] > NOTHING and visits[s, a] == 1.0) if tries else q[s, a] == best:
            if pick == 0:
                return a
            pick -= 1
    return NO_ACTION


@kernel
def weight(s, a, excluded, best, scale, q):
    """
    Unnormalised probability of one action (2.24): the best weighs 1, the excluded one 0.

    scale: 1 / temperature.
    """
    if a == excluded:
        return 0.0
    return math.exp((q[s, a] - best) * scale)


@kernel
def drawn(u, w0, w1, w2, w3):
    """Index drawn in proportion to the four weights; u: uniform in [0, 1)."""
    c0 = w0
    c1 = c0 + w1
    c2 = c1 + w2
    total = c2 + w3
    x = u * total
    if x >= total:  # rounded up: the last that has a weight
        return 3 if w3 > 0.0 else 2 if w2 > 0.0 else 1 if w1 > 0.0 else 0
    return int(x >= c0) + int(x >= c1) + int(x >= c2)
