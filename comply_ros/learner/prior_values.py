# SPDX-License-Identifier: Apache-2.0
"""What a learner with a model believes beforehand: of slips, of a mentor, of what is untried."""

import math

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import (
    Array,
    HITS,
    LARGEST_REWARD,
    LearnerState,
    SCALE,
    TRIALS,
)
from comply_ros.numerics.jit import kernel

TRUSTED_UNTRIED = 0.3  # share of the largest reward that is expected where a mentor is trusted
UNPROVED = 0.1  # pieces of advice taken for wrong before any was proved, where spread is 1
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
def record_of(state: LearnerState) -> float:
    """Share rho of advice that proved good; 1 before any was put to the proof."""
    return state.advice_agreed[0] / state.advice_seen[0]


@kernel
def doubt_of(state: LearnerState) -> float:
    """Share of advice that may be wrong: 1 - rho, and more as long as little was proved."""
    unproved = UNPROVED * outcome_spread(state.pooled)
    return 1.0 - state.advice_agreed[0] / (state.advice_seen[0] + unproved)


@kernel
def credence(state: LearnerState) -> float:
    """Credit of a mentor with the record rho: max(0, 2 rho - 1)^2, so 0 for one half and less."""
    lead = max(0.0, 2.0 * record_of(state) - 1.0)
    return lead * lead


@kernel
def expected_untried_value(s: int, a: int, alone: bool, config: KernelConfig,
                           state: LearnerState) -> float:
    """
    Value of action a of state s while it was never tried.

    It is a share of the largest reward, `untried_value`; less where there is advice of a mentor
    with credit. Advice adds to it, or takes from it if the record is below one half; other
    actions are worth no more than the advised one, as far as the mentor has credit.

    alone: as if there were no advice for any other action of the state.
    """
    largest, advised = max(state.pooled[LARGEST_REWARD], 0.0), state.advised[s]
    if advised < 0:
        return config.untried_value * largest
    credit = credence(state)
    value = largest * (config.untried_value
                       - credit * max(0.0, config.untried_value - TRUSTED_UNTRIED))
    if a == advised:
        return value + ADVICE_BONUS * state.pooled[SCALE] * (2.0 * record_of(state) - 1.0)
    if alone or state.visits[s, advised] == 1.0:
        return value
    return (1.0 - credit) * value + credit * min(value, state.q[s, advised])
