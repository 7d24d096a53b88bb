# SPDX-License-Identifier: Apache-2.0
"""One step of a learner: it chooses an action, then learns from the reward of the last one."""

from __future__ import annotations

from comply_ros.learner.action_choice import choose, policy_action
from comply_ros.learner.confidence import apply_advice_prior
from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import Advice, Array, LearnerState
from comply_ros.learner.mentor_of_episode import choose_mentor
from comply_ros.learner.prioritized_sweeping import plan_episode
from comply_ros.learner.update_rules import learn
from comply_ros.numerics.jit import kernel
from comply_ros.world.grid import NO_ACTION


@kernel
def choose_and_learn(learns: bool, last_s: int, last_a: int, last_advice: Advice, r: float, s: int,
                     step: int, terminated: bool, advice: Advice, u_listen: float, u_act: float,
                     config: KernelConfig, state: LearnerState,
                     policy: Array) -> tuple[int, float, int]:
    """
    Change the state by one transition; return the action in state s, the confidence, the mentor.

    The action is -1 where the episode has ended; without advice, the confidence in it is 0, and
    the mentor that it is from -1.

    Parameters
    ----------
    learns: whether arrays may change.
    last_s, last_a, last_advice: of the step before; an action of -1: nothing is learned.
    r: reward of that action.
    step: of the episode, from 0.
    terminated: s is terminal and has the value 0.
    advice: `advice[m]`, the action of each mentor in s, -1 for none.
    u_listen, u_act: uniform in [0, 1).
    policy: `policy[s]` of a learner that does not learn.

    """
    a, p, m = choose_action(learns, s, step, terminated, advice, u_listen, u_act, config, state,
                            policy)
    if learns and last_a != NO_ACTION:
        learn(last_s, last_a, r, s, a, terminated, last_advice, u_listen, config, state)
    return a, p, m


@kernel
def choose_action(learns: bool, s: int, step: int, terminated: bool, advice: Advice,
                  u_listen: float, u_act: float, config: KernelConfig, state: LearnerState,
                  policy: Array) -> tuple[int, float, int]:
    """
    Return what `choose_and_learn` returns; change the state by the advice alone.

    learns, terminated, advice, u_listen, u_act, policy: as there.
    """
    a, p, m = NO_ACTION, 0.0, -1
    if not terminated and not config.learns:
        a = policy_action(s, u_act, policy, state.q, config.actions)
    elif not terminated:
        if learns:
            apply_advice_prior(s, advice, config, state)
            if len(config.has_planner) > 0 and step == 0:
                plan_episode(u_listen, u_act, config, state)
            if len(config.has_bandit) > 0 and step == 0:
                choose_mentor(config, state)
        a, p, m = choose(s, advice, step, u_listen, u_act, config, state)
    return a, p, m
