# SPDX-License-Identifier: Apache-2.0
"""Eligibility traces (section 2.3.3): how an error reaches the steps that led to it."""

from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import Array
from comply_ros.numerics.action_values import Actions, count_actions
from comply_ros.numerics.jit import kernel


@kernel
def mark_trace(s: int, a: int, config: KernelConfig, traces: Array, trail: Array) -> None:
    """Change traces and trail: state s and action a become eligible, accumulating or replacing."""
    if traces[s, a] == 0.0:
        trail[0] += 1
        trail[trail[0]] = count_actions(config.actions) * s + a
    traces[s, a] = 1.0 if config.replacing_traces else traces[s, a] + 1.0


@kernel
def propagate_along_traces(change: float, decay: float, floor: float, q: Array, traces: Array,
                           trail: Array, actions: Actions) -> None:
    """
    Change q along the trail by change times the trace, then multiply the traces by decay.

    A trace that falls below the floor, or to 0, leaves the trail.
    """
    count, n_actions = 0, count_actions(actions)
    for i in range(1, trail[0] + 1):
        pair = trail[i]
        s = pair >> 2 if n_actions == 4 else pair // n_actions  # a shift is faster
        a = pair - n_actions * s
        trace = traces[s, a]
        q[s, a] += change * trace
        trace *= decay
        if trace < floor or trace == 0.0:
            traces[s, a] = 0.0
        else:
            traces[s, a] = trace
            count += 1
            trail[count] = pair
    trail[0] = count


@kernel
def clear_traces(traces: Array, trail: Array, actions: Actions) -> None:
    """Change traces and trail: nothing is eligible any more."""
    n_actions = count_actions(actions)
    for i in range(1, trail[0] + 1):
        s = trail[i] >> 2 if n_actions == 4 else trail[i] // n_actions
        traces[s, trail[i] - n_actions * s] = 0.0
    trail[0] = 0
