# SPDX-License-Identifier: Apache-2.0
"""Model of all outcomes of each action, with a slip prior of all states, and its backups."""

from comply_ros.learner.improvement_chance import update_potential
from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import (
    ALTERNATIVES,
    Array,
    COUNT,
    HITS,
    LARGEST_REWARD,
    LearnerState,
    OUTCOMES,
    PREDECESSORS,
    REWARD,
    SCALE,
    SUCCESSOR,
    TERMINAL,
    TRIALS,
    USUAL,
    USUAL_COUNT,
    USUAL_VALUE,
    VALUE_SUM,
)
from comply_ros.learner.outcome_sums import store_sample_squares, sum_up, TOLERANCE
from comply_ros.learner.prior_values import (
    expected_untried_value,
    scale_of_rewards,
    usual_probability,
)
from comply_ros.learner.slip_prior import prior_size, score_sizes
from comply_ros.numerics.action_values import count_actions, NOTHING
from comply_ros.numerics.jit import kernel, long_kernel

MOST_BACKUPS = 20  # of other states, after each step
TIME_COST = 3e-4  # of the largest reward: what a step costs beside its reward


@kernel
def record_transition(s: int, a: int, r: float, s2: int, done: bool, state: LearnerState) -> None:
    """
    Change model, pooled, prior_sizes, reward_squares, visits, predecessors by one transition.

    The ninth outcome of an action, and any later one, is counted with the rarest that is kept,
    the last of them where several are: the newest of these stands for all.
    """
    model, pooled = state.model, state.pooled
    successor = TERMINAL if done else float(s2)
    place, usual, rarest = -1, 0, 0
    for k in range(OUTCOMES):
        if model[s, a, k, COUNT] == 0.0:
            place = k if place < 0 else place
            break
        if model[s, a, k, COUNT] > model[s, a, usual, COUNT]:
            usual = k
        if model[s, a, k, COUNT] <= model[s, a, rarest, COUNT]:
            rarest = k
        if model[s, a, k, SUCCESSOR] == successor:
            place = k
    place = rarest if place < 0 else place
    if len(state.prior_sizes) > 0:
        if state.visits[s, a] >= 2.0:  # tried before: there is something to predict it from
            score_sizes(s, a, place, usual, successor, state)
        elif state.departures[s] > 2.0:  # this one is counted there already
            pooled[ALTERNATIVES] += 1.0
    if state.visits[s, a] >= 3.0:  # twice before: there is a usual outcome
        pooled[TRIALS] += 1.0
        pooled[HITS] += 1.0 if place == usual else 0.0
    pooled[LARGEST_REWARD] = max(pooled[LARGEST_REWARD], r)
    pooled[SCALE] = max(pooled[SCALE], abs(r))
    is_new = model[s, a, place, COUNT] == 0.0 or model[s, a, place, SUCCESSOR] != successor
    if is_new and not done:
        _add_predecessor(s2, s, state.predecessors)
    model[s, a, place, SUCCESSOR] = successor
    model[s, a, place, COUNT] += 1.0
    count = model[s, a, place, COUNT]
    before = model[s, a, place, REWARD]
    model[s, a, place, REWARD] += (r - before) / count
    if len(state.reward_squares) > 0:
        state.reward_squares[s, a] += (r - before) * (r - model[s, a, place, REWARD])
    state.visits[s, a] += 1.0


@kernel
def _add_predecessor(s: int, before: int, predecessors: Array) -> None:
    """Change predecessors[s]: the first 16 states that lead to s are kept, after their number."""
    count = predecessors[s, 0]
    for i in range(1, count + 1):
        if predecessors[s, i] == before:
            return
    if count < PREDECESSORS:
        predecessors[s, 0] = count + 1
        predecessors[s, count + 1] = before


@kernel
def mark_step(s: int, s2: int, traces: Array, trail: Array, config: KernelConfig) -> None:
    """
    Change traces and trail: traces[s, 0] counts how often s was left in this episode.

    A step to s2 = s, which leads nowhere, counts twice.
    """
    if traces[s, 0] == 0.0:
        trail[0] += 1
        trail[trail[0]] = count_actions(config.actions) * s
    traces[s, 0] += 2.0 if s2 == s else 1.0


@long_kernel('has_model', None)
def learn_outcome(s: int, a: int, r: float, s2: int, done: bool, config: KernelConfig,
                  state: LearnerState) -> None:
    """Change the model by one transition, and the values of s and of states that lead there."""
    record_transition(s, a, r, s2, done, state)
    mark_step(s, s2, state.traces, state.trail, config)
    if not done and state.departures[s2] == 1.0:
        back_up(s2, config, state)  # before it was ever left: what is expected of it
    _back_up_and_pass_on(s, config, state)
    propagate(config, state)


@kernel
def propagate(config: KernelConfig, state: LearnerState) -> None:
    """Change the values of the states that wait, first come, first served; at most 20 of them."""
    queue, size = state.queue, len(state.queued)
    for _ in range(MOST_BACKUPS):
        if queue[1] == 0:
            return
        s = queue[2 + queue[0]]
        queue[0] = (queue[0] + 1) % size
        queue[1] -= 1
        state.queued[s] = 0
        _back_up_and_pass_on(s, config, state)


@kernel
def _back_up_and_pass_on(s: int, config: KernelConfig, state: LearnerState) -> None:
    """Change the values of s; if its state value moved, the states that lead there wait."""
    change = back_up(s, config, state)
    if change <= TOLERANCE * state.pooled[SCALE]:
        return
    queue, queued, size = state.queue, state.queued, len(state.queued)
    for i in range(1, state.predecessors[s, 0] + 1):
        before = state.predecessors[s, i]
        if queued[before] == 0:
            queued[before] = 1
            queue[2 + (queue[0] + queue[1]) % size] = before
            queue[1] += 1


@long_kernel('has_model', 0.0)
def back_up(s: int, config: KernelConfig, state: LearnerState) -> float:
    """
    Change what is computed of s: q, values, sample_squares, potential.

    Return by how much values[s] changed.

    An action with n samples has the value (2.10) of its counts and of `prior_size` samples more: a
    share p of them the usual outcome, the others as the other actions of the state.
    """
    q, visits, workspace = state.q, state.visits, state.workspace
    samples, value_sum, best_value, best_successor = sum_up(s, config, state)
    p, prior, top, greedy = usual_probability(state.pooled), prior_size(config, state), NOTHING, 0
    store_sample_squares(s, config, state)
    cost = TIME_COST * scale_of_rewards(state.pooled)
    for a in range(count_actions(config.actions)):
        if q[s, a] <= NOTHING:
            continue
        count = visits[s, a] - 1.0
        if count == 0.0:
            q[s, a] = expected_untried_value(s, a, False, config, state)
        else:
            usual = _intended_value(s, a, config, state)
            others = usual
            if samples > count:
                others = (value_sum - workspace[a, VALUE_SUM]) / (samples - count)
            believed = prior * (p * usual + (1.0 - p) * others)
            q[s, a] = (workspace[a, VALUE_SUM] + believed) / (count + prior) - cost
        if q[s, a] > top:
            top, greedy = q[s, a], a
    change = abs(top - state.values[s])
    state.values[s] = top
    margin = TOLERANCE * state.pooled[SCALE]
    update_potential(s, greedy, margin, best_value, best_successor, config, state)
    return change


@kernel
def _intended_value(s: int, a: int, config: KernelConfig, state: LearnerState) -> float:
    """
    Value of the usual outcome of an action that was tried.

    Where another action has that outcome more often, this one may only have slipped there: then
    its usual outcome is not known yet, and has the value of an action never tried.
    """
    workspace = state.workspace
    for b in range(count_actions(config.actions)):
        if b != a and workspace[b, USUAL_COUNT] > workspace[a, USUAL_COUNT] \
                and workspace[b, USUAL] == workspace[a, USUAL]:
            return expected_untried_value(s, -1, True, config, state)
    return workspace[a, USUAL_VALUE]
