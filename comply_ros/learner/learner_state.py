# SPDX-License-Identifier: Apache-2.0
"""The arrays that a learner learns in, and their digest."""

from __future__ import annotations

from collections.abc import Sequence
import hashlib
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.numerics.jit import plain_fields, plain_view
from comply_ros.world.mdp import World

ONE_MENTOR = ('',)  # the names of the mentors, where there is one without a name
# Arrays with rows for each mentor.
OF_MENTORS = ('belief', 'advised', 'verdicts', 'advice_agreed', 'advice_seen', 'pool_size',
              'pool_listen', 'pool_discard', 'followed')
LISTEN, DISCARD, IN_POOL = range(3)  # belief[s, ...]
HITS, TRIALS, LARGEST_REWARD, SCALE, ALTERNATIVES = range(5)  # pooled[...]
IN_USE, FIRST_SCORE, N_SIZES = 0, 1, 6  # prior_sizes[...]; the sizes are powers of 2, from 1 on
USUAL_PLACE = 3  # of the size in use before any outcome was predicted, 8 samples
FIRST_RECORD = 4.0  # pieces of advice of a mentor taken for good before any was proved
EPISODES, MEAN, LOWEST, HIGHEST = range(4)  # followed[m, ...]
OUTCOMES, PREDECESSORS = 8, 16  # that a model keeps of each action, and of each state
COUNT, SUCCESSOR, REWARD = range(3)  # model[s, a, k, ...]
TERMINAL = -1.0  # successor of an outcome that ends the episode in a terminal state
EARLIER, CHANGE = range(2)  # value_changes[s, ...]
SAMPLES, VALUE_SUM, SQUARE_SUM, USUAL, USUAL_COUNT, USUAL_VALUE = range(6)  # workspace[a, ...]

# In a node the fields are memoryviews of the arrays: single elements come three times as fast.
Array = NDArray[Any]
Advice = Sequence[int] | NDArray[Any]  # `advice[m]` of mentor m, -1 for none


class LearnerState(NamedTuple):
    """
    What a learner has learned. Kernels change its arrays in place.

    Scalars are arrays of one element. An array that a preset does not use has no elements, so a
    new array changes no digest of the presets that were there before it.

    Attributes
    ----------
    q: `q[s, a]`, action values; -inf where the state does not have the action.
    visits: `visits[s, a]`, the c of the learning rate (2.26), from 1 upwards.
    belief: `belief[s, LISTEN]` and `belief[s, DISCARD]`: alpha and beta of (3.7), or the two
        values of (3.10); `belief[s, IN_POOL]`: 1 if the state is in the pool of the prior. Of
        mentor m in row `m * n_states + s`.
    departures: `departures[s]`, 1 + the number of actions taken in s.
    scheduled_confidence: the confidence p of scheduled trust (3.6).
    temperature: of the softmax (2.25).
    trust_rate: the rate gamma of (4.2).
    guided_stage: how many times a jump start was shortened.
    best_return: the best mean return of an iteration.
    advice_agreed, advice_seen: how often the advice was the best action, of how many times; of
        each mentor. Both begin with 1. With trust by track record both begin with 4; then the
        pieces of advice that are good, of those that are good or bad, and of episodes without a
        reward.
    pool_size, pool_listen, pool_discard: number of beliefs in the pool of the prior, and sums; of
        each mentor.
    confidences: `confidences[m]` in each of several mentors at the last decision.
    followed: `followed[m]`, where one mentor is followed for an episode: the number of episodes
        with mentor m, their mean return, the lowest one and the highest one.
    followed_mentor: int64: the mentor of this episode, or the best one after it; -1 for none.
    traces: `traces[s, a]`, eligibility (2.20); or `traces[s, 0]`, visited in this episode.
    trail: int64: the number of traces above 0, then `n_actions * s + a` of each.
    outcomes: `outcomes[s, a]`: mean reward, most frequent successor, its votes.
    half_difference: `half_difference[s, a]`: of the two tables of double Q-learning, which are
        q + half_difference and q - half_difference.
    model: `model[s, a, k]` of outcome k: number of samples, successor, mean reward.
    pooled: over all states: how often an action had its usual outcome, of how many times; the
        largest reward, and the largest absolute value of a reward; with a prior of slips, how
        often an action was tried for the first time in a state that had been left before.
    prior_sizes: the size of the prior of slips in use, then the logarithm of the likelihood of all
        outcomes so far with a prior of 1, 2, 4, 8, 16 and 32 samples.
    reward_squares: `reward_squares[s, a]`: sum of the squares of the differences of rewards from
        the mean reward of their outcome.
    sample_squares: `sample_squares[s, a]`: sum of the squared distances of the values of all
        samples from their mean, when the state was backed up last.
    values: `values[s]`, of the best action.
    value_changes: `value_changes[s, EARLIER]`, the value at the last visit, and
        `value_changes[s, CHANGE]`, running mean of by how much it differs from visit to visit.
    potential: `potential[s, a]`: probability of trying an action that may be better than it looks.
    advised: int64: `advised[s]`, the newest advice, -1 for none; rows as of `belief`.
    verdicts: int64: `verdicts[s]` on this advice: 1 good, -1 bad, 0 not known; rows as of
        `belief`.
    predecessors: int64: `predecessors[s]`: a number of states that lead to s, then these states.
    queue: int64: where the first state that waits for a backup is, and how many wait; then a ring
        of states. With a planner: how many wait, then a heap of states, see `promote`.
    queued: int64: `queued[s]`, 1 if the state waits; with a planner, its place in the heap or 0.
    workspace: what the last backup knew of each action; or the weight of each action in the last
        estimate of how consistent mentors are.
    priority: `priority[s]` of a state that waits, with a planner.
    sampled: `sampled[s, a, k]`, the probability of outcome k in the model that PSRL has drawn; the
        last one is that of an outcome not seen yet.

    """

    q: Array
    visits: Array
    belief: Array
    departures: Array
    scheduled_confidence: Array
    temperature: Array
    trust_rate: Array
    guided_stage: Array
    best_return: Array
    advice_agreed: Array
    advice_seen: Array
    pool_size: Array
    pool_listen: Array
    pool_discard: Array
    traces: Array
    trail: Array
    outcomes: Array
    half_difference: Array
    model: Array
    pooled: Array
    values: Array
    potential: Array
    advised: Array
    predecessors: Array
    queue: Array
    queued: Array
    workspace: Array
    priority: Array
    sampled: Array
    confidences: Array
    followed: Array
    followed_mentor: Array
    prior_sizes: Array
    reward_squares: Array
    sample_squares: Array
    value_changes: Array
    verdicts: Array

    def views(self) -> Any:
        """Return memoryviews of the same arrays, by name, for kernels that run as plain Python."""
        return plain_fields(LearnerState(*map(plain_view, self)))

    def digest(self) -> str:
        """SHA-256 (hex) over all elements as little-endian float64, field after field."""
        sha = hashlib.sha256()
        for array in self:
            sha.update(array.astype('<f8').tobytes())
        return sha.hexdigest()


def initial_state(world: World, config: LearnerConfig, n_mentors: int = 1) -> LearnerState:
    """State of a learner that has not seen anything of the world yet."""
    states, n_actions = world.n_states, world.n_actions
    leaves_traces = config.trace_decay > 0 or config.replays or config.learns_model
    traced = states if leaves_traces else 0
    first_belief = (config.belief_listen, config.belief_discard)
    first_record = FIRST_RECORD if config.trust == 'track_record' else 1.0

    def scalar(value: float) -> Array:
        return np.array([value])

    def of_each_mentor(value: float) -> Array:
        return np.full(n_mentors, value)
    return LearnerState(
        q=np.where(world.available, config.initial_value, -np.inf),
        visits=np.ones((states, n_actions)),
        belief=np.tile(np.array((*first_belief, 0.0)), (n_mentors * states, 1)),
        departures=np.ones(states),
        scheduled_confidence=scalar(config.confidence), temperature=scalar(config.temperature),
        trust_rate=scalar(config.trust_rate),
        guided_stage=scalar(0.0), best_return=scalar(-np.inf),
        advice_agreed=of_each_mentor(first_record), advice_seen=of_each_mentor(first_record),
        pool_size=of_each_mentor(1.0), pool_listen=of_each_mentor(first_belief[0]),
        pool_discard=of_each_mentor(first_belief[1]),
        traces=np.zeros((traced, n_actions)),
        trail=np.zeros(1 + n_actions * traced, dtype=np.int64),
        outcomes=np.zeros((states if config.replays else 0, n_actions, 3)),
        **{**LATER_ARRAYS, **_later_arrays(states, n_actions, config, n_mentors)})


def arranged_state(state: LearnerState, before: Sequence[str], after: Sequence[str],
                   fresh: LearnerState) -> LearnerState:
    """
    Return what was learned with the mentors `before`, for a learner with the mentors `after`.

    A mentor keeps what was learned of it, by its name; of any other one it is as in `fresh`, the
    state of a learner with the mentors `after` that has not seen anything.
    """
    return state._replace(confidences=fresh.confidences, **{
        name: arranged_rows(getattr(state, name), before, after, getattr(fresh, name))
        for name in OF_MENTORS})


def arranged_rows(array: Array, before: Sequence[str], after: Sequence[str],
                  fresh: Array) -> Array:
    """Return an array with as many rows for each mentor, in another order: `arranged_state`."""
    found, length = fresh.copy(), len(fresh) // len(after)
    for m, mentor in enumerate(after):
        if mentor in before:
            start = before.index(mentor) * length
            found[m * length:(m + 1) * length] = array[start:start + length]
    return found


def _later_arrays(states: int, n_actions: int, config: LearnerConfig,
                  n_mentors: int) -> dict[str, Array]:
    """Return those of LATER_ARRAYS that the settings use, before anything was seen."""
    arrays: dict[str, Array] = {}
    if config.doubles:
        arrays['half_difference'] = np.zeros((states, n_actions))
    if config.learns_model or config.planner != 'none':
        arrays |= {
            'model': np.zeros((states, n_actions, OUTCOMES, 3)), 'pooled': np.zeros(4),
            'predecessors': np.zeros((states, 1 + PREDECESSORS), dtype=np.int64),
            'queue': np.zeros(2 + states, dtype=np.int64),
            'queued': np.zeros(states, dtype=np.int64)}
    if config.learns_model:
        arrays |= {
            'values': np.zeros(states), 'potential': np.zeros((states, n_actions)),
            'advised': np.full(n_mentors * states, -1), 'workspace': np.zeros((n_actions, 6)),
            'pooled': np.zeros(5), 'reward_squares': np.zeros((states, n_actions)),
            'sample_squares': np.zeros((states, n_actions)),
            'value_changes': np.zeros((states, 2)),
            'verdicts': np.zeros(n_mentors * states, dtype=np.int64),
            'prior_sizes': np.array([2.0 ** USUAL_PLACE] + N_SIZES * [0.0])}
    if config.planner != 'none':
        arrays['priority'] = np.zeros(states)
    if config.planner == 'psrl':
        arrays['sampled'] = np.zeros((states, n_actions, OUTCOMES + 1))
    if config.shapes_by_estimates():
        arrays['workspace'] = np.zeros((n_actions, 1))
    if config.trust == 'returns':
        arrays |= {'followed': np.zeros((n_mentors, 4)), 'followed_mentor': np.array([-1])}
    if n_mentors > 1:
        arrays['confidences'] = np.zeros(n_mentors)
    return arrays


# Arrays that came later, as they are where the settings do not use them: what was saved before has
# none of them.
LATER_ARRAYS: dict[str, Array] = {
    **{name: np.zeros(0)
       for name in ('pooled', 'values', 'priority', 'confidences', 'prior_sizes')},
    **{name: np.zeros((0, 0))
       for name in ('half_difference', 'potential', 'workspace', 'followed', 'reward_squares',
                    'sample_squares', 'value_changes')},
    **{name: np.zeros(0, dtype=np.int64)
       for name in ('advised', 'verdicts', 'queue', 'queued', 'followed_mentor')},
    'predecessors': np.zeros((0, 0), dtype=np.int64), 'sampled': np.zeros((0, 0, 0)),
    'model': np.zeros((0, 0, 0, 0))}
