# SPDX-License-Identifier: Apache-2.0
"""A mentor as a state machine that advises by the newest policy of another, running learner."""

from __future__ import annotations

import numpy as np

from comply_ros.mentor.mentor_policies import sparse_policy
from comply_ros.mentor.policy_validation import PolicyError, validate_policy
from comply_ros.protocol.changing_mentor import ChangingMentor
from comply_ros.protocol.messages import Notice, Outputs, Policy, Rejected, WorldDescription
from comply_ros.protocol.world_description import (
    is_same_world,
    with_hash,
    world_from_description,
)


class LearnerMentor(ChangingMentor):
    """
    Advises what another learner would do, which learns in a copy of this world meanwhile.

    It answers at once: no advice before the first policy, and where the other learner knows
    nothing. Where that is gone, its last policy counts until there is a newer one. In another
    world it is not followed, and there is no advice.

    Parameters
    ----------
    learner: namespace of the other learner, for messages.
    coverage: share of the states in which there is advice.
    seed: of the draw of these states.
    name: of this mentor.

    """

    def __init__(self, learner: str, coverage: float = 1.0, seed: int = 0,
                 name: str = '') -> None:
        self.learner, self._coverage, self._seed = learner, coverage, seed
        self._other: WorldDescription | None = None  # the newest world of the other learner
        self._received: Policy | None = None  # its newest policy, until that is used
        self._follows = False  # whether a policy of it is used in this world
        super().__init__(name)

    def waiting_for(self) -> str | None:
        """Text of what this mentor needs to continue; None where it has everything."""
        if self.world is None or self._follows:
            return super().waiting_for()
        return (f'a policy of the learner {self.learner}: does it run, in the same world as this '
                'mentor?')

    def on_learner_world(self, msg: WorldDescription) -> Outputs:
        """
        Remember the world of the other learner; return outputs.

        Raises
        ------
        ValueError: if it does not describe a world.

        """
        if self._other and msg.run == self._other.run:
            return ()
        self._other = with_hash(msg, world_from_description(msg))
        return self._follow()

    def on_learner_policy(self, msg: Policy) -> Outputs:
        """Advise by a policy of the other learner, if its world is this one; return outputs."""
        self._received = msg
        return self._follow()

    def _start_run(self, is_reset: bool) -> Outputs:
        """Take part in a new run; in another world, wait for another policy."""
        self._follows = self._follows and not self.tracker.world_changed
        return (*super()._start_run(is_reset), *self._follow())

    def _follow(self) -> Outputs:
        """Use the newest policy if it is of this world; return outputs."""
        here, other, policy = self.tracker.description, self._other, self._received
        if here is None or self.world is None or other is None:
            return ()
        if not is_same_world(other, here):
            if self._follows:
                self._follows = False
                self._advise_nothing(self.world)
            return (Rejected('world of the other learner', f'the learner {self.learner} must be '
                             f'in the world of this mentor, {_text(here)}, got {_text(other)}'),)
        if policy is None or policy.run != other.run:
            return ()
        self._received, followed = None, self._follows
        try:
            fitting = validate_policy(np.array(policy.action), self.world, clear_not_free=True)
        except PolicyError as error:
            return (Rejected('policy of the other learner', str(error)),)
        self._set(sparse_policy(fitting, self.world, self._coverage, self._seed))
        self._follows = True
        return () if followed else (Notice(f'advises by the policy of the learner '
                                           f'{self.learner}'),)


def _text(world: WorldDescription) -> str:
    return f'{world.name!r} (hash {world.sha256[:12]!r})'
