# SPDX-License-Identifier: Apache-2.0
"""What a learner with a model believes beforehand: of slips, of a mentor, of what is untried."""

import math

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import (
    ALTERNATIVES,
    Array,
    HITS,
    LARGEST_REWARD,
    LearnerState,
    SCALE,
    TRIALS,
)
from comply_ros.numerics.action_values import count_actions, NOTHING
from comply_ros.numerics.jit import kernel

TRUSTED_UNTRIED = 0.3  # share of the largest reward that is expected where a mentor is trusted
MOST_SURE = 0.98  # of several mentors, none counts as more often right than this
UNPROVED = 0.03  # failures of advice that are supposed, beside those that were seen
UNPROVED_SPREAD = 0.8  # the same, in addition, where outcomes are as random as can be
NEAR = 0.7  # of the confidence that what a mentor left aside is not better than its advice nearby
ADVICE_BONUS = 0.03  # of the largest reward: what advice adds to an action never tried


@kernel
def usual_probability(pooled: Array) -> float:
    """Probability p that an action has its usual outcome, learned over all states."""
    return (pooled[HITS] + 1.0) / (pooled[TRIALS] + 1.0)


@kernel
def outcome_spread(pooled: Array) -> float:
    """Return how random outcomes are, 2 sqrt(p (1 - p)): 0 where nothing slips, 1 at the most."""
    p = usual_probability(pooled)
    return 2.0 * math.sqrt(p * (1.0 - p))


@kernel
def scale_of_rewards(pooled: Array) -> float:
    """Return the largest absolute value of a reward so far; 1 before any was other than 0."""
    return pooled[SCALE] if pooled[SCALE] > 0.0 else 1.0


@kernel
def record_of(m: int, state: LearnerState) -> float:
    """Share rho of the advice of mentor m that is good; 4 pieces are good from the start."""
    return state.advice_agreed[m] / state.advice_seen[m]


@kernel
def doubt_of(m: int, state: LearnerState) -> float:
    """
    Probability that advice of mentor m is wrong: 1 - rho, but never less than u / (u + 1 + t).

    t: how often another action was tried beside what was known, over all states. So a mentor that
    never proved wrong is doubted less and less, but is put to the proof for ever: about as often
    as the root of the number of steps.
    """
    spread = outcome_spread(state.pooled)
    unproved = UNPROVED + UNPROVED_SPREAD * spread * spread
    tests = 1.0 + state.pooled[ALTERNATIVES]
    return max(1.0 - record_of(m, state), unproved / (unproved + tests))


@kernel
def credence(m: int, state: LearnerState) -> float:
    """Credit of mentor m with the record rho: max(0, 2 rho - 1)^2, so 0 for one half and less."""
    lead = max(0.0, 2.0 * record_of(m, state) - 1.0)
    return lead * lead


@kernel
def share_of_advice(s: int, a: int, config: KernelConfig, state: LearnerState) -> float:
    """
    Probability that action a of state s is the right one, for all that mentors said and proved.

    Bayes' rule, as if mentors were right independently of each other: each with the probability
    of its record rho, and else with all other actions equally likely. With one mentor, rho where
    it advises a.
    """
    states, mine, total, have = len(state.departures), 0.0, 0.0, 0.0
    for b in range(count_actions(config.actions)):
        have += 1.0 if state.q[s, b] > NOTHING else 0.0
    for b in range(count_actions(config.actions)):
        if state.q[s, b] > NOTHING:
            weight = 1.0
            for m in range(len(config.mentors)):
                advised = state.advised[m * states + s]
                if advised >= 0:
                    rho = min(record_of(m, state), MOST_SURE)
                    weight *= rho if advised == b else (1.0 - rho) / max(have - 1.0, 1.0)
            total += weight
            mine = weight if b == a else mine
    return mine / total if total > 0.0 else 0.0


@kernel
def credit(s: int, m: int, a: int, config: KernelConfig, state: LearnerState) -> float:
    """
    Credit of advice a of mentor m in state s: `credence`, or more where other mentors agree.

    Then it is max(0, 2 P - 1)^2, with the P of `share_of_advice` in the place of the record.
    """
    if len(config.mentors) == 1:
        return credence(m, state)
    lead = max(0.0, 2.0 * share_of_advice(s, a, config, state) - 1.0)
    return max(lead * lead, credence(m, state))


@kernel
def expected_untried_value(s: int, a: int, alone: bool, config: KernelConfig,
                           state: LearnerState) -> float:
    """
    Value of action a of state s while it was never tried.

    It is a share of the largest reward, `untried_value`; less where there is advice of a mentor
    with credit. Advice adds to it, or takes from it if the record is below one half; other
    actions are worth no more than the advised one, as far as the mentor has credit. Of several
    mentors that advise in s, the one with the most credit counts, and each adds to what it
    advises.

    A state that was first reached from another one, where the mentor may have advised something
    else, is not expected to be much better than what the mentor advised there.

    alone: as if there were no advice for any other action of the state.
    """
    largest, states = max(state.pooled[LARGEST_REWARD], 0.0), len(state.departures)
    advised, most, lead, is_advised = -1, 0.0, 0.0, False
    for m in range(len(config.mentors)):
        action = state.advised[m * states + s]
        if action >= 0:
            trust = credit(s, m, action, config, state)
            if advised < 0 or trust > most:
                advised, most = action, trust
            if action == a:
                is_advised = True
                lead += 2.0 * record_of(m, state) - 1.0
    if advised < 0:
        return config.untried_value * largest
    value = largest * (config.untried_value
                       - most * max(0.0, config.untried_value - TRUSTED_UNTRIED))
    if is_advised:
        value += ADVICE_BONUS * state.pooled[SCALE] * lead
    if alone:
        return value
    if state.predecessors[s, 0] > 0:
        nearby = _value_of_advice(state.predecessors[s, 1], config, state)
        value -= NEAR * math.sqrt(most) * max(0.0, value - nearby)
    if is_advised or state.visits[s, advised] == 1.0:
        return value
    return (1.0 - most) * value + most * min(value, state.q[s, advised])


@kernel
def _value_of_advice(s: int, config: KernelConfig, state: LearnerState) -> float:
    """Return the highest value of advice in state s that was tried; inf where none was."""
    states, best = len(state.departures), NOTHING
    for m in range(len(config.mentors)):
        action = state.advised[m * states + s]
        if action >= 0 and state.visits[s, action] > 1.0:
            best = max(best, state.q[s, action])
    return best if best > NOTHING else math.inf
