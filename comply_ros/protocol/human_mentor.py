# SPDX-License-Identifier: Apache-2.0
"""A human mentor as a state machine: a policy edited while it is used, and steering by hand."""

from __future__ import annotations

from collections.abc import Mapping

from comply_ros.mentor.policy_validation import validate_advice
from comply_ros.protocol.changing_mentor import ChangingMentor
from comply_ros.protocol.message_validation import validate_observation
from comply_ros.protocol.messages import Outputs, StateReward, step_id
from comply_ros.world.grid import NO_ACTION


class HumanMentor(ChangingMentor):
    """
    A mentor without advice at first, whose policy a person changes at any time.

    While the person steers, an observation waits for the person, and the answer becomes part of
    the policy.

    Attributes
    ----------
    steering: whether observations wait for the person.
    waiting: the observation that waits, or None.
    robot: the newest observation of this run, or None.

    """

    def __init__(self, name: str = '') -> None:
        self.steering = False
        self.waiting: StateReward | None = None
        self.robot: StateReward | None = None
        super().__init__(name)

    def _start_run(self, is_reset: bool) -> Outputs:
        """Take part in a new run; nothing waits for the person there."""
        self.waiting, self.robot = None, None
        return super()._start_run(is_reset)

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
        policy, world = self._known()
        policy = policy.copy()
        for state, action in cells.items():
            validate_advice(state, action, world)
            policy[state] = action
        self._set(policy)

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
        return self._answer_waiting(action)

    def give_up(self) -> Outputs:
        """Return the recommendation for the state that waits: no advice; the policy stays."""
        return self._answer_waiting(NO_ACTION)

    def set_steering(self, steering: bool) -> Outputs:
        """Steer from now on, or not; return outputs for the observation that waits."""
        self.steering = steering
        if steering or self.waiting is None or self.policy is None:
            return ()
        return self._answer_waiting(self.policy[self.waiting.state])

    def _advise_new(self, msg: StateReward) -> Outputs:
        """Return the recommendation for a state; none while the person steers."""
        if self.waiting is None or step_id(msg) > step_id(self.waiting):
            self.waiting = msg
        if self.steering or self.policy is None:
            return ()
        return self._answer_waiting(self.policy[msg.state])

    def _answer_waiting(self, action: int) -> Outputs:
        """Return the recommendation in the state that waits."""
        msg, self.waiting = self.waiting, None
        return () if msg is None else self._recommend(msg, action)
