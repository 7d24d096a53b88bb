# SPDX-License-Identifier: Apache-2.0
"""Confidence of the baselines: policy reuse, policy shaping, jump start (see methods.py)."""

import math

from comply_ros.numerics.jit import kernel
from comply_ros.numerics.q_ops import max_q_except


@kernel
def reused(p, step, method):
    """Return p after `step` steps of an episode: policy reuse (methods.py, `pi_reuse`)."""
    if method.reuse_factor == 1.0:
        return p
    return p * math.pow(method.reuse_factor, float(step))  # compiled, a whole power has other bits


@kernel
def shaped(s, advice, consistency, temperature, q):
    """
    Probability of the advice where it is multiplied into the softmax (2.24): policy shaping.

    consistency: how often advice is right, C; one opinion for the action makes its odds C / (1-C)
    times as high (methods.py, `policy_shaping`).
    """
    best, others = max_q_except(s, -1, q), 0.0
    for a in range(4):
        if a != advice:
            others += math.exp((q[s, a] - best) / temperature)
    right = consistency * math.exp((q[s, advice] - best) / temperature)
    wrong = (1.0 - consistency) * others
    return right / (right + wrong) if right > 0.0 else 0.0


@kernel
def guided_steps(stage, method):
    """First steps of an episode in which a jump start is led, after `stage` shortenings."""
    return method.guided_steps * max(0.0, 1.0 - stage / method.guided_stages)
