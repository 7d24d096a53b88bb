# SPDX-License-Identifier: Apache-2.0
"""Model of the usual outcome of each action, and backups of action values from it."""

from comply_ros.learner.eligibility_traces import clear_traces
from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import Array, LearnerState
from comply_ros.learner.outcome_model import back_up
from comply_ros.numerics.action_values import Actions, count_actions, max_q_except, NOTHING
from comply_ros.numerics.jit import kernel

REWARD, SUCCESSOR, VOTES = range(3)  # outcomes[s, a, ...]
TERMINAL = -1.0  # successor of an action that ends the episode in a terminal state


@kernel
def record_outcome(s: int, a: int, r: float, s2: int, done: bool, count: float,
                   outcomes: Array) -> None:
    """
    Change outcomes[s, a] by one transition; count: how often a was taken in s, this one included.

    The successor is the one that most transitions led to (majority vote of Boyer and Moore, which
    needs no memory of the others), the reward the mean over the transitions. Transitions that end
    the episode are never averaged with others: a slip into the goal does not have its reward.
    """
    successor = TERMINAL if done else float(s2)
    if count == 1.0:
        outcomes[s, a, REWARD], outcomes[s, a, SUCCESSOR] = r, successor
        outcomes[s, a, VOTES] = 1.0
        return
    usual = outcomes[s, a, SUCCESSOR]
    alike = (usual == TERMINAL) == done
    if alike:
        outcomes[s, a, REWARD] += (r - outcomes[s, a, REWARD]) / count
    outcomes[s, a, VOTES] += 1.0 if successor == usual else -1.0
    if outcomes[s, a, VOTES] <= 0.0:
        outcomes[s, a, SUCCESSOR], outcomes[s, a, VOTES] = successor, 1.0
        if not alike:
            outcomes[s, a, REWARD] = r


@kernel
def backup(s: int, discount: float, q: Array, visits: Array, outcomes: Array,
           actions: Actions) -> None:
    """Change q[s] of every action that was tried: its reward and its successor's value (2.10)."""
    for a in range(count_actions(actions)):
        if visits[s, a] > 1.0:
            successor = int(outcomes[s, a, SUCCESSOR])
            value = 0.0 if successor < 0 else max_q_except(successor, -1, q, actions)
            if value > NOTHING:
                q[s, a] = outcomes[s, a, REWARD] + discount * value


@kernel
def mark_visited(s: int, traces: Array, trail: Array, actions: Actions) -> None:
    """Change traces and trail: state s was visited in this episode, as the last new one."""
    if traces[s, 0] == 0.0:
        traces[s, 0] = 1.0
        trail[0] += 1
        trail[trail[0]] = count_actions(actions) * s


@kernel
def finish_episode(config: KernelConfig, state: LearnerState) -> None:
    """Clear the traces; with a model, first back up the states of the episode, last one first."""
    if config.replays or len(config.has_model) > 0:
        for i in range(state.trail[0], 0, -1):
            s = state.trail[i] // count_actions(config.actions)
            if len(config.has_model) > 0:
                back_up(s, config, state)
            else:
                backup(s, config.discount, state.q, state.visits, state.outcomes, config.actions)
    clear_traces(state.traces, state.trail, config.actions)
