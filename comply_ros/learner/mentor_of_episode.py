# SPDX-License-Identifier: Apache-2.0
"""Choice of one mentor for an episode, by the returns of the episodes with each: RLPA."""

import math

import numpy as np

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import EPISODES, HIGHEST, LearnerState, LOWEST, MEAN
from comply_ros.numerics.jit import kernel, long_kernel


@long_kernel('has_bandit', None)
def choose_mentor(config: KernelConfig, state: LearnerState) -> None:
    """
    Change followed_mentor when an episode begins: the one with the highest bound of its return.

    The mean return with it, and `return_bonus` times the range of all returns seen times
    sqrt(2 log t / n), after t episodes, n of them with it: UCB1 of Auer, Cesa-Bianchi and Fischer
    (2002). Who was not followed yet comes first. Ties go to the first one.
    """
    episodes = 0.0
    lowest, highest = math.inf, -math.inf
    for m in range(len(config.mentors)):
        if state.followed[m, EPISODES] == 0.0:
            state.followed_mentor[0] = m
            return
        episodes += state.followed[m, EPISODES]
        lowest = min(lowest, state.followed[m, LOWEST])
        highest = max(highest, state.followed[m, HIGHEST])
    scale = config.return_bonus * (highest - lowest) * math.sqrt(2.0 * math.log(episodes))
    _follow_best(scale, config, state)


@kernel
def _follow_best(scale: float, config: KernelConfig, state: LearnerState) -> None:
    """Change followed_mentor: the one, of those followed, with the highest mean and bonus."""
    chosen, best = -1, -math.inf
    for m in range(len(config.mentors)):
        if state.followed[m, EPISODES] > 0.0:
            bound = state.followed[m, MEAN] + scale / math.sqrt(state.followed[m, EPISODES])
            if bound > best:
                chosen, best = m, bound
    state.followed_mentor[0] = chosen


@long_kernel('has_bandit', None)
def record_return(r: float, config: KernelConfig, state: LearnerState) -> None:
    """
    Change what is known of the mentor followed, by the return r of an episode that has ended.

    Until the next episode begins, followed_mentor is the one with the highest mean return.
    """
    m = state.followed_mentor[0]
    if m < 0:  # the episode began before mentors were chosen
        return
    first = state.followed[m, EPISODES] == 0.0
    state.followed[m, EPISODES] += 1.0
    state.followed[m, MEAN] += (r - state.followed[m, MEAN]) / state.followed[m, EPISODES]
    state.followed[m, LOWEST] = r if first else min(r, state.followed[m, LOWEST])
    state.followed[m, HIGHEST] = r if first else max(r, state.followed[m, HIGHEST])
    _follow_best(0.0, config, state)


def best_followed(state: LearnerState) -> LearnerState:
    """
    Return the arrays with the mentor of the highest mean return as the one that is followed.

    A learner that stops to explore follows that one, whoever is tried in this episode.
    """
    followed = np.where(state.followed[:, EPISODES] > 0.0, state.followed[:, MEAN], -np.inf)
    best = int(followed.argmax()) if (followed > -np.inf).any() else -1
    return state._replace(followed_mentor=np.array([best]))
