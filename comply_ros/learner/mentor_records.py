# SPDX-License-Identifier: Apache-2.0
"""Records of the mentors of a learner with a model: how often their advice proved good."""

from comply_ros.learner.advice_chance import (
    advice_chance,
    believed_chance,
    best_tried,
    chance_as_good,
    in_loop,
    SAME,
    TRUSTED,
)
from comply_ros.learner.learner_config import KernelConfig, TRACK_RECORD
from comply_ros.learner.learner_state import Advice, LearnerState, SCALE
from comply_ros.learner.prior_values import credit, expected_untried_value, record_of
from comply_ros.numerics.action_values import count_actions, NOTHING
from comply_ros.numerics.jit import kernel, long_kernel
from comply_ros.world.grid import NO_ACTION

NOT_BY_CHANCE = 0.02  # bad advice of a trusted mentor has less chance than this to be as good
MORE_WITH_CREDIT = 3.0  # times `SAME`: how much worse good advice may be, in addition


@long_kernel('has_model', None)
def hear_advice(s: int, advice: Advice, config: KernelConfig, state: LearnerState) -> None:
    """
    Change the advice known in s, the values of actions never tried, and the mentors' records.

    Advice counts for the record once it was tried, and another action of the state too; and
    against it where it leads round in circles.

    advice: `advice[m]`, -1 for none.
    """
    for m in range(len(config.mentors)):
        if advice[m] >= 0 and config.trust == TRACK_RECORD:
            state.advised[m * len(state.departures) + s] = advice[m]
    looping = in_loop(s, state)
    for a in range(count_actions(config.actions)):
        if state.q[s, a] > NOTHING and state.visits[s, a] == 1.0:
            state.q[s, a] = expected_untried_value(s, a, looping, config, state)
    for m in range(len(config.mentors)):
        if advice[m] >= 0 and config.trust == TRACK_RECORD:
            _record_advice(s, m, advice[m], looping, config, state)


@kernel
def _record_advice(s: int, m: int, advice: int, looping: bool, config: KernelConfig,
                   state: LearnerState) -> None:
    """
    Change the record of mentor m by its advice in state s.

    Advice is good if its value is not below the best one that was tried, except for a few times
    `SAME`. It is bad if it is more likely worse than not, with this record; of a trusted mentor,
    only if chance can hardly explain its value. Else it does not count.
    """
    value, other = state.q[s, advice], best_tried(s, advice, config, state)
    is_best = other == NO_ACTION or value > state.q[s, other]
    if looping and not (is_best and advice_chance(s, m, advice, config, state) > 0.0):
        state.advice_seen[m] += 1.0
    elif state.visits[s, advice] > 1.0 and other != NO_ACTION:
        trust = credit(s, m, advice, config, state)
        slack = (1.0 + MORE_WITH_CREDIT * trust) * SAME * state.pooled[SCALE]
        if value >= state.q[s, other] - slack:
            state.advice_seen[m] += 1.0
            state.advice_agreed[m] += 1.0
            return
        chance = chance_as_good(s, advice, other, config, state)
        if believed_chance(chance, record_of(m, state)) < 0.5 and (
                trust <= TRUSTED or chance < NOT_BY_CHANCE):
            state.advice_seen[m] += 1.0
