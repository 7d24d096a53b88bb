# SPDX-License-Identifier: Apache-2.0
"""Update of the trust in the mentor: Beta belief, or values of following it or not (3.12)."""

from comply_ros.learner.learner_config import BETA, KernelConfig
from comply_ros.learner.learner_state import Array, DISCARD, IN_POOL, LearnerState, LISTEN
from comply_ros.numerics.action_values import max_q_except, NOTHING
from comply_ros.numerics.jit import kernel


@kernel
def update_belief(s: int, a: int, m: int, advice: int, delta: float, config: KernelConfig,
                  state: LearnerState) -> None:
    """
    Change the belief in mentor m and its pool after a step with action a in state s.

    By (4.2) or (3.12).

    Parameters
    ----------
    advice: of this mentor in s.
    delta: what the step earned beyond q[s, advice] (3.8), from q before its update. The values of
        listening and discarding are updated from `state.q` as it is.

    """
    belief, row = state.belief, m * len(state.departures) + s
    listen, discard = belief[row, LISTEN], belief[row, DISCARD]
    if config.trust == BETA:
        update_beta(row, a == advice, delta, state.trust_rate[0], config, belief)
    else:
        update_listening_values(s, row, a, advice, config, state.q, belief)
    if belief[row, IN_POOL] == 0.0:  # the whole belief is new to the pool
        belief[row, IN_POOL] = 1.0
        state.pool_size[m] += 1.0
        listen, discard = 0.0, 0.0
    state.pool_listen[m] += belief[row, LISTEN] - listen
    state.pool_discard[m] += belief[row, DISCARD] - discard


@kernel
def beta_mean(alpha: float, beta: float) -> float:
    """
    Mean of Beta(alpha, beta), the p that is used in practice (section 4.1.1).

    The published runs cut alpha and beta at 0, and (4.2) of the text can lead below 0. Without
    alpha, p is 0, also where both are gone; without beta alone, p is 1.
    """
    if alpha <= 0.0:
        return 0.0
    if beta <= 0.0:
        return 1.0
    return alpha / (alpha + beta)


@kernel
def update_beta(row: int, listened: bool, delta: float, rate: float, config: KernelConfig,
                belief: Array) -> None:
    """
    Change belief[row]: alpha where the mentor's action was taken, beta where not (4.2).

    rate: the gamma of (4.2). A belief with alpha + beta <= 0 stays as it is.
    """
    alpha, beta = belief[row, LISTEN], belief[row, DISCARD]
    if alpha + beta <= 0.0:
        return
    if config.sign_only:
        delta = 1.0 if delta > 0.0 else -1.0 if delta < 0.0 else 0.0
    if listened:
        alpha += rate * beta / (alpha + beta) * delta
    else:
        beta += rate * alpha / (alpha + beta) * delta
    if config.bounded_belief:
        alpha, beta = max(alpha, 0.0), max(beta, 0.0)
    belief[row, LISTEN], belief[row, DISCARD] = alpha, beta


@kernel
def update_listening_values(s: int, row: int, a: int, advice: int, config: KernelConfig, q: Array,
                            belief: Array) -> None:
    """Change belief[row]: the values of listening and of discarding in state s (3.12)."""
    old, new = 1.0 - config.trust_rate, config.trust_rate
    if a == advice or config.updates_both:
        belief[row, LISTEN] = old * belief[row, LISTEN] + new * q[s, advice]
    if a != advice or config.updates_both:
        best = max_q_except(s, advice, q, config.actions)
        if best > NOTHING:  # a dead end has no other action
            belief[row, DISCARD] = old * belief[row, DISCARD] + new * best


@kernel
def pooled_belief(m: int, config: KernelConfig, state: LearnerState) -> tuple[float, float]:
    """
    First belief in mentor m in a state: as strong as the prior, with the mean of its pool.

    Empirical Bayes (section 5.3): the mean over the states left and the prior itself.
    """
    listen = state.pool_listen[m] / state.pool_size[m]
    discard = state.pool_discard[m] / state.pool_size[m]
    if config.trust != BETA:
        return listen, discard
    share = beta_mean(listen, discard)
    strength = config.belief_listen + config.belief_discard
    return strength * share, strength * (1.0 - share)
