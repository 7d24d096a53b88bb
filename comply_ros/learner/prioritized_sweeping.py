# SPDX-License-Identifier: Apache-2.0
"""What a planner computes after each step, and PSRL when an episode begins."""

from comply_ros.learner.learner_config import KernelConfig, PSRL
from comply_ros.learner.learner_state import LearnerState, SCALE
from comply_ros.learner.outcome_model import MOST_BACKUPS, record_transition
from comply_ros.learner.outcome_sums import TOLERANCE
from comply_ros.learner.planned_values import chance, plan_state
from comply_ros.learner.posterior_sampling import draw_outcomes, has_doubled
from comply_ros.learner.priority_queue import pop, promote
from comply_ros.numerics.action_values import count_actions
from comply_ros.numerics.gamma_variate import generator_from
from comply_ros.numerics.jit import kernel, long_kernel

FIRST = 1e308  # priority of the state that was left: above any other
MOST_SWEEPS = 50  # of PSRL, over all states that were left before


@long_kernel('has_planner', None)
def learn_and_sweep(s: int, a: int, r: float, s2: int, done: bool, u: float, config: KernelConfig,
                    state: LearnerState) -> None:
    """
    Change the model by one transition, then the values of s, and of up to 20 states that wait.

    The one with the highest priority is first. With PSRL, the values change only where the
    samples of the action have doubled: then its outcomes are drawn anew.

    u: uniform in [0, 1), the seed of what is drawn.
    """
    record_transition(s, a, r, s2, done, state)
    if config.planner == PSRL:
        if not has_doubled(state.visits[s, a] - 1.0):
            return
        draw_outcomes(s, a, generator_from(u, u), config, state)
    promote(s, FIRST, state)
    for _ in range(1 + MOST_BACKUPS):
        if state.queue[0] == 0:
            return
        _sweep(pop(state), config, state)


@kernel
def _sweep(s: int, config: KernelConfig, state: LearnerState) -> None:
    """Change q[s]; if its state value moved, the states that lead there wait."""
    change, least = plan_state(s, config, state), TOLERANCE * state.pooled[SCALE]
    if change <= least:
        return
    for i in range(1, state.predecessors[s, 0] + 1):
        before = state.predecessors[s, i]
        priority = change * config.discount * chance(before, s, config, state)
        if priority > least:
            promote(before, priority, state)


@long_kernel('has_planner', None)
def plan_episode(u_listen: float, u_act: float, config: KernelConfig, state: LearnerState) -> None:
    """
    Change sampled and q when an episode begins, with PSRL: draw a model, and plan in it.

    Value iteration in the order of the states, forth and back, until no value changes any more, or
    for 50 sweeps.

    u_listen, u_act: uniform in [0, 1), the seed of what is drawn.
    """
    if config.planner != PSRL:
        return
    word, states = generator_from(u_listen, u_act), len(state.departures)
    for s in range(states):
        for a in range(count_actions(config.actions)):
            if state.visits[s, a] > 1.0:
                word = draw_outcomes(s, a, word, config, state)
    for sweep in range(MOST_SWEEPS):
        largest = 0.0
        for i in range(states):
            s = i if sweep % 2 == 0 else states - 1 - i
            if state.departures[s] > 1.0:
                largest = max(largest, plan_state(s, config, state))
        if largest <= TOLERANCE * state.pooled[SCALE]:
            return
