# SPDX-License-Identifier: Apache-2.0
"""Values from remembered outcomes: where each action usually leads, and what it earns."""

from comply_ros.learner.eligibility_traces import end_traces
from comply_ros.numerics.jit import kernel
from comply_ros.numerics.q_ops import max_q_except, NOTHING

REWARD, SUCCESSOR, VOTES = range(3)  # outcomes[s, a, ...]
THE_END = -1.0  # successor of an action that ends the episode in a terminal state


@kernel
def record_outcome(s, a, r, s2, done, count, outcomes):
    """
    Change outcomes[s, a] by one step; count: how often the action was taken here, with this step.

    The successor is the one that most steps led to (majority vote of Boyer and Moore, which needs
    no memory of the others), the reward the mean over the steps; a step that ends the episode
    and one that does not are never averaged: a slip into the goal is not worth the goal.
    """
    successor = THE_END if done else float(s2)
    if count == 1.0:
        outcomes[s, a, REWARD], outcomes[s, a, SUCCESSOR] = r, successor
        outcomes[s, a, VOTES] = 1.0
        return
    usual = outcomes[s, a, SUCCESSOR]
    alike = (usual == THE_END) == done
    if alike:
        outcomes[s, a, REWARD] += (r - outcomes[s, a, REWARD]) / count
    outcomes[s, a, VOTES] += 1.0 if successor == usual else -1.0
    if outcomes[s, a, VOTES] <= 0.0:
        outcomes[s, a, SUCCESSOR], outcomes[s, a, VOTES] = successor, 1.0
        if not alike:
            outcomes[s, a, REWARD] = r


@kernel
def backup(s, discount, q, visits, outcomes):
    """Change q[s]: of every action tried, its reward and the value of where it leads (2.10)."""
    for a in range(4):
        if visits[s, a] > 1.0:
            successor = int(outcomes[s, a, SUCCESSOR])
            value = 0.0 if successor < 0 else max_q_except(successor, -1, q)
            if value > NOTHING:
                q[s, a] = outcomes[s, a, REWARD] + discount * value


@kernel
def mark_visited(s, traces, trail):
    """Change traces and trail: state s was visited in this episode, as the last new one."""
    if traces[s, 0] == 0.0:
        traces[s, 0] = 1.0
        trail[0] += 1
        trail[trail[0]] = 4 * s


@kernel
def end_episode(method, q, visits, outcomes, traces, trail):
    """Change q, if outcomes are replayed: refresh the episode's states, last first. End traces."""
    if method.replays:
        for i in range(trail[0], 0, -1):
            backup(trail[i] >> 2, method.discount, q, visits, outcomes)
    end_traces(traces, trail)
