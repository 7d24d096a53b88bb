# SPDX-License-Identifier: Apache-2.0
"""A human mentor as a state machine: a policy edited while it is used, and steering by hand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comply_ros.mentor.policy_validation import PolicyError, validate_advice, validate_policy
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Outputs, Recommendation, StateReward, step_id
from comply_ros.protocol.validation import validate_observation
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World


class HumanMentor(Mentor):
    """
    A mentor without advice at first, whose policy a person changes at any time.

    A change counts from the next observation on: a repeated observation gets the same
    recommendation. While the person steers, an observation waits for the person, and the answer
    becomes part of the policy.

    Attributes
    ----------
    edited_policy: `advice[s]`, never changed in place; None before a world.
    steering: whether observations wait for the person.
    waiting: the observation that waits, or None.
    robot: the newest observation of this run, or None.

    """

    def __init__(self, name: str = '') -> None:
        self.edited_policy: NDArray[Any] | None = None
        self.steering = False
        self.waiting: StateReward | None = None
        self.robot: StateReward | None = None
        super().__init__(name=name)

    def _start_run(self, is_reset: bool) -> Outputs:
        """Take part in a new run; the policy stays where the map is the same."""
        self.waiting, self.robot = None, None
        outputs = super()._start_run(is_reset)
        if self.policy is None and self.world is not None:
            self._set(np.full(self.world.n_states, NO_ACTION, dtype=self.world.action_type))
        return outputs

    def observe(self, msg: StateReward) -> Outputs:
        """Return the recommendation for a state; none where it waits for the person."""
        if msg.run == self.tracker.run and self.world is not None and (
                self.robot is None or step_id(msg) >= step_id(self.robot)) \
                and validate_observation(msg, self.world) is None:
            self.robot = msg
        if msg.terminated and self.waiting and step_id(msg) > step_id(self.waiting):
            self.waiting = None  # the learner continued without
        return super().observe(msg)

    def edit(self, cells: Mapping[int, int]) -> None:
        """
        Change the advice in some states, from the next observation on.

        cells: actions by state, -1 for no advice.

        Raises
        ------
        ValueError: if there is no world yet, a state is outside of the grid or nobody can act in
            it, or the state does not have the action; then nothing changes.

        """
        policy, world = self._policy_to_edit()
        policy = policy.copy()
        for state, action in cells.items():
            validate_advice(state, action, world)
            policy[state] = action
        self._set(policy)

    def replace(self, policy: ArrayLike) -> None:
        """
        Advise by `policy[s]` from the next observation on, -1 for no advice.

        Raises
        ------
        ValueError: as for `edit`.

        """
        _, world = self._policy_to_edit()
        self._set(validate_policy(policy, world))

    def steer(self, action: int) -> Outputs:
        """
        Return the recommendation in the state that waits, if one does; it joins the policy.

        Raises
        ------
        ValueError: as for `edit`.

        """
        if self.waiting is None:
            return ()
        self.edit({self.waiting.state: action})
        return self._recommend(action)

    def give_up(self) -> Outputs:
        """Return the recommendation for the state that waits: no advice; the policy stays."""
        return self._recommend(NO_ACTION)

    def set_steering(self, steering: bool) -> Outputs:
        """Steer from now on, or not; return outputs for the observation that waits."""
        self.steering = steering
        if steering or self.waiting is None or self.policy is None:
            return ()
        return self._recommend(self.policy[self.waiting.state])

    def _set(self, policy: NDArray[Any]) -> None:
        policy.flags.writeable = False
        self.edited_policy, self.policy = policy, policy.tolist()

    def _policy_to_edit(self) -> tuple[NDArray[Any], World]:
        if self.edited_policy is None or self.world is None:
            raise PolicyError('a policy must be for a world, and none is known yet')
        return self.edited_policy, self.world

    def _advise(self, msg: StateReward) -> Outputs:
        """Return the recommendation for a state, the same for one that is repeated."""
        if self._observed and step_id(msg) <= step_id(self._observed):
            if step_id(msg) == step_id(self._observed):
                return self._answer
            return (self.tracker.too_late(step_id(msg)),)
        if self.waiting is None or step_id(msg) > step_id(self.waiting):
            self.waiting = msg
        if self.steering or self.policy is None:
            return ()
        return self._recommend(self.policy[msg.state])

    def _recommend(self, action: int) -> Outputs:
        """Return the recommendation in the state that waits."""
        msg, self.waiting, self._ticks = self.waiting, None, 0
        if msg is None:
            return ()
        self.tracker.answer(msg)
        self.step_count, self._observed = self.step_count + 1, msg
        self._answer = (Recommendation(*msg[:4], action, self.name),)
        return self._answer
