# SPDX-License-Identifier: Apache-2.0
"""Posterior sampling (PSRL): the outcomes of an action, drawn as they may be for all it knows."""

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import COUNT, LearnerState, OUTCOMES
from comply_ros.numerics.gamma_variate import gamma_variate
from comply_ros.numerics.jit import kernel, long_kernel


@long_kernel('has_planner', 0)
def draw_outcomes(s: int, a: int, word: int, config: KernelConfig, state: LearnerState) -> int:
    """
    Change sampled[s, a] by a draw from the posterior of the outcomes; return the next word.

    It is the Dirichlet distribution of their counts, and of `unseen_weight` for an outcome not
    seen yet: gamma variates, divided by their sum. word: of `generator_from` or `next_word`.
    """
    sampled, total = state.sampled, 0.0
    for k in range(OUTCOMES + 1):
        count = config.unseen_weight if k == OUTCOMES else state.model[s, a, k, COUNT]
        sampled[s, a, k] = 0.0
        if count > 0.0:
            sampled[s, a, k], word = gamma_variate(count, word)
            total += sampled[s, a, k]
    for k in range(OUTCOMES + 1):
        sampled[s, a, k] /= total
    return word


@kernel
def has_doubled(samples: float) -> bool:
    """Whether a number of samples is 1, 2, 4, and so on: a power of two."""
    return int(samples) & (int(samples) - 1) == 0
