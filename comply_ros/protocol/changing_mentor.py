# SPDX-License-Identifier: Apache-2.0
"""A mentor as a state machine whose policy changes while it is used."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comply_ros.mentor.policy_validation import PolicyError, validate_policy
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Outputs, Recommendation, StateReward, step_id
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World


class ChangingMentor(Mentor):
    """
    A mentor without advice at first, whose policy may change at any time.

    A change counts from the next observation on: a repeated observation gets the same
    recommendation.

    Attributes
    ----------
    current_policy: `advice[s]`, never changed in place; None before a world.

    """

    def __init__(self, name: str = '') -> None:
        self.current_policy: NDArray[Any] | None = None
        super().__init__(name=name)

    def replace(self, policy: ArrayLike) -> None:
        """
        Advise by `policy[s]` from the next observation on, -1 for no advice.

        Raises
        ------
        ValueError: if there is no world yet, or the policy does not fit it; then nothing changes.

        """
        _, world = self._known()
        self._set(validate_policy(policy, world))

    def _start_run(self, is_reset: bool) -> Outputs:
        """Take part in a new run; the policy stays where the world is the same."""
        outputs = super()._start_run(is_reset)
        if self.policy is None and self.world is not None:
            self._advise_nothing(self.world)
        return outputs

    def _advise_nothing(self, world: World) -> None:
        self._set(np.full(world.n_states, NO_ACTION, dtype=world.action_type))

    def _set(self, policy: NDArray[Any]) -> None:
        policy.flags.writeable = False
        self.current_policy, self.policy = policy, policy.tolist()

    def _known(self) -> tuple[NDArray[Any], World]:
        """Return the policy and its world; raise PolicyError before there are any."""
        if self.current_policy is None or self.world is None:
            raise PolicyError('a policy must be for a world, and none is known yet')
        return self.current_policy, self.world

    def _advise(self, msg: StateReward) -> Outputs:
        """Return the recommendation for a state, the same for one that is repeated."""
        if self._observed and step_id(msg) <= step_id(self._observed):
            if step_id(msg) == step_id(self._observed):
                return self._answer
            return (self.tracker.too_late(step_id(msg)),)
        return self._advise_new(msg)

    def _advise_new(self, msg: StateReward) -> Outputs:
        """Return the recommendation for a state that is not repeated."""
        assert self.policy is not None
        return self._recommend(msg, self.policy[msg.state])

    def _recommend(self, msg: StateReward, action: int) -> Outputs:
        """Return an action as the recommendation for a state."""
        self._ticks = 0
        self.tracker.answer(msg)
        self.step_count, self._observed = self.step_count + 1, msg
        self._answer = (Recommendation(*msg[:4], action, self.name),)
        return self._answer
