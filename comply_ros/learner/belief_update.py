# SPDX-License-Identifier: Apache-2.0
"""Update of the trust in the mentor: Beta belief, or values of following it or not (3.12)."""

from comply_ros.learner.learner_config import BETA, KernelConfig
from comply_ros.learner.learner_state import Array, DISCARD, IN_POOL, LearnerState, LISTEN
from comply_ros.numerics.action_values import max_q_except, NOTHING
from comply_ros.numerics.jit import kernel


@kernel
def update_belief(s: int, a: int, advice: int, delta: float, config: KernelConfig,
                  state: LearnerState) -> None:
    """
    Change belief[s] and the pool after a step with action a in state s: (4.2), (3.12).

    delta: what the step earned beyond q[s, advice] (3.8), from q before its update; `state.q` is
        the updated one.

    """
    belief = state.belief
    listen, discard = belief[s, LISTEN], belief[s, DISCARD]
    if config.trust == BETA:
        update_beta(s, a == advice, delta, state.trust_rate[0], config, belief)
    else:
        update_listening_values(s, a, advice, config, state.q, belief)
    if belief[s, IN_POOL] == 0.0:  # the whole belief is new to the pool
        belief[s, IN_POOL] = 1.0
        state.pool_size[0] += 1.0
        listen, discard = 0.0, 0.0
    state.pool_listen[0] += belief[s, LISTEN] - listen
    state.pool_discard[0] += belief[s, DISCARD] - discard


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
def update_beta(s: int, listened: bool, delta: float, rate: float, config: KernelConfig,
                belief: Array) -> None:
    """
    Change belief[s]: alpha where the mentor's action was taken, beta where not (4.2).

    rate: the gamma of (4.2). A belief with alpha + beta <= 0 stays as it is.
    """
    alpha, beta = belief[s, LISTEN], belief[s, DISCARD]
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
    belief[s, LISTEN], belief[s, DISCARD] = alpha, beta


@kernel
def update_listening_values(s: int, a: int, advice: int, config: KernelConfig, q: Array,
                            belief: Array) -> None:
    """Change belief[s]: the values of listening and of discarding (3.12)."""
    old, new = 1.0 - config.trust_rate, config.trust_rate
    if a == advice or config.updates_both:
        belief[s, LISTEN] = old * belief[s, LISTEN] + new * q[s, advice]
    if a != advice or config.updates_both:
        best = max_q_except(s, advice, q, config.actions)
        if best > NOTHING:  # a dead end has no other action
            belief[s, DISCARD] = old * belief[s, DISCARD] + new * best


@kernel
def pooled_belief(config: KernelConfig, state: LearnerState) -> tuple[float, float]:
    """
    First belief in a state: as strong as the prior, with the mean of all states in the pool.

    Empirical Bayes (section 5.3): the mean over the states left and the prior itself.
    """
    listen = state.pool_listen[0] / state.pool_size[0]
    discard = state.pool_discard[0] / state.pool_size[0]
    if config.trust != BETA:
        return listen, discard
    share = beta_mean(listen, discard)
    strength = config.belief_listen + config.belief_discard
    return strength * share, strength * (1.0 - share)
