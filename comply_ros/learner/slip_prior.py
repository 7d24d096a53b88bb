# SPDX-License-Identifier: Apache-2.0
"""How much the prior of slips counts: as many samples as have predicted outcomes best so far."""

import math

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import (
    COUNT,
    FIRST_SCORE,
    HITS,
    IN_USE,
    LearnerState,
    N_SIZES,
    OUTCOMES,
    SUCCESSOR,
    TRIALS,
    USUAL_PLACE,
)
from comply_ros.numerics.jit import kernel

UNSEEN, PLACES = 0.1, 0.8  # samples of an outcome that no other action had; and of all of them


@kernel
def prior_size(config: KernelConfig, state: LearnerState) -> float:
    """Return how many samples the prior counts as: `slip_prior`, or where that is 0 the best."""
    return config.slip_prior if config.slip_prior > 0.0 else state.prior_sizes[IN_USE]


@kernel
def score_sizes(s: int, a: int, outcome: int, usual: int, successor: float,
                state: LearnerState) -> None:
    """
    Change prior_sizes by what each size would have predicted of an outcome, before it counts.

    With n samples of the action, c of this outcome, and a share o of the samples of the other
    actions of the state, a prior of K samples gave it the probability
    (c + K (p [usual] + (1 - p) o)) / (n + K), with p = (hits + 1) / (trials + 2). Of equal scores
    the prior of 8 samples is used, else the smallest.

    Parameters
    ----------
    outcome: place of the outcome among those of the action. usual: place of its usual outcome.
    successor: where the outcome leads, which is new if that is another one than in this place.

    """
    model, pooled, sizes = state.model, state.pooled, state.prior_sizes
    same, samples = 0.0, 0.0
    for b in range(len(state.workspace)):
        if b != a:
            for k in range(OUTCOMES):
                count = model[s, b, k, COUNT]
                if count == 0.0:
                    break
                samples += count
                if model[s, b, k, SUCCESSOR] == successor:
                    same += count
    if samples == 0.0:
        return
    p, own = (pooled[HITS] + 1.0) / (pooled[TRIALS] + 2.0), 0.0
    if model[s, a, outcome, SUCCESSOR] == successor:
        own = model[s, a, outcome, COUNT]
    believed = (1.0 - p) * (same + UNSEEN) / (samples + PLACES)
    believed += p if own > 0.0 and outcome == usual else 0.0
    n, size = state.visits[s, a] - 1.0, 1.0
    for i in range(FIRST_SCORE, FIRST_SCORE + N_SIZES):
        sizes[i] += math.log((own + size * believed) / (n + size))
        size *= 2.0
    best = FIRST_SCORE + USUAL_PLACE
    for i in range(FIRST_SCORE, FIRST_SCORE + N_SIZES):
        best = i if sizes[i] > sizes[best] else best
    sizes[IN_USE] = math.pow(2.0, best - FIRST_SCORE)
