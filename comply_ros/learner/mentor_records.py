# SPDX-License-Identifier: Apache-2.0
"""Records of the mentors of a learner with a model: how much of their advice is good."""

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
from comply_ros.learner.learner_state import Advice, CHANGE, EARLIER, LearnerState, SCALE
from comply_ros.learner.prior_values import credit, expected_untried_value, record_of
from comply_ros.numerics.action_values import count_actions, NOTHING
from comply_ros.numerics.jit import kernel, long_kernel
from comply_ros.world.grid import NO_ACTION

NOT_BY_CHANCE = 0.02  # bad advice of a trusted mentor has less chance than this to be as good
MORE_WITH_CREDIT = 3.0  # times `SAME`: how much worse good advice may be, in addition


@long_kernel('has_model', None)
def hear_advice(s: int, advice: Advice, config: KernelConfig, state: LearnerState) -> None:
    """
    Change what is known of the advice in s, value_changes, and q of actions never tried.

    The advice itself is in advised; what it is worth in verdicts and in the mentors' records.

    advice: `advice[m]`, -1 for none.
    """
    _note_change(s, state)
    for m in range(len(config.mentors)):
        if advice[m] >= 0 and config.trust == TRACK_RECORD:
            state.advised[m * len(state.departures) + s] = advice[m]
    looping = in_loop(s, state)
    for a in range(count_actions(config.actions)):
        if state.q[s, a] > NOTHING and state.visits[s, a] == 1.0:
            state.q[s, a] = expected_untried_value(s, a, looping, config, state)
    for m in range(len(config.mentors)):
        if advice[m] >= 0 and config.trust == TRACK_RECORD:
            _judge(m * len(state.departures) + s, m,
                   _verdict(s, m, advice[m], looping, config, state), state)


@kernel
def count_fruitless_episode(config: KernelConfig, state: LearnerState) -> None:
    """
    Change the records of the mentors that advised in an episode without any reward, at its end.

    Before there was a reward other than 0, no value says whether advice is good. So each whole
    episode counts as one piece of bad advice.
    """
    if state.pooled[SCALE] != 0.0:
        return
    for m in range(len(config.mentors)):
        has_advised = False
        for i in range(1, state.trail[0] + 1):
            s = state.trail[i] // count_actions(config.actions)
            has_advised = has_advised or state.advised[m * len(state.departures) + s] >= 0
        if has_advised:
            state.advice_seen[m] += 1.0


@kernel
def _note_change(s: int, state: LearnerState) -> None:
    """Change value_changes[s]: a running mean over visits, which forgets half at each visit."""
    changes, value = state.value_changes, state.values[s]
    if state.departures[s] > 1.0:
        changes[s, CHANGE] = 0.5 * (changes[s, CHANGE] + abs(value - changes[s, EARLIER]))
    changes[s, EARLIER] = value


@kernel
def _judge(place: int, m: int, verdict: int, state: LearnerState) -> None:
    """Change a verdict, `verdicts[place]`, on advice of mentor m, and the record of m."""
    before = state.verdicts[place]
    if verdict != before:
        state.verdicts[place] = verdict
        state.advice_seen[m] += abs(verdict) - abs(before)
        state.advice_agreed[m] += max(verdict, 0) - max(before, 0)


@kernel
def _verdict(s: int, m: int, advice: int, looping: bool, config: KernelConfig,
             state: LearnerState) -> int:
    """
    Return whether advice of mentor m in state s is good, 1, or bad, -1; 0: it is not known.

    It is known once the advice was tried, another action of the state too, and there was a reward
    other than 0. Advice is good if its value is not below the best one that was tried, except for
    a few times `SAME`. It is bad if it is more likely worse than not, with this record; of a
    trusted mentor, only if chance can hardly explain its value. It is bad, too, where it leads
    round in circles.
    """
    value, other = state.q[s, advice], best_tried(s, advice, config, state)
    is_best = other == NO_ACTION or value > state.q[s, other]
    if looping and not (is_best and advice_chance(s, m, advice, config, state) > 0.0):
        return -1
    if other == NO_ACTION or state.visits[s, advice] == 1.0 or state.pooled[SCALE] == 0.0:
        return 0
    trust = credit(s, m, advice, config, state)
    slack = (1.0 + MORE_WITH_CREDIT * trust) * SAME * state.pooled[SCALE]
    if value >= state.q[s, other] - slack:
        return 1
    chance = chance_as_good(s, advice, other, config, state)
    is_likely_wrong = believed_chance(chance, record_of(m, state)) < 0.5
    return -1 if is_likely_wrong and (trust <= TRUSTED or chance < NOT_BY_CHANCE) else 0
