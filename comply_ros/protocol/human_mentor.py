# SPDX-License-Identifier: Apache-2.0
"""A person as the mentor: a policy that is painted while it is used, and steering by hand."""

import numpy as np

from comply_ros.mentor.policy_text import PolicyError, validate_policy
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Recommendation, step_id
from comply_ros.protocol.validation import validate_state
from comply_ros.world.grid import NO_ACTION


class HumanMentor(Mentor):
    """
    A mentor without advice at first, whose policy changes whenever the person wants.

    A change counts from the next question on: a question that is repeated gets the same answer.
    While steering, the robot's question waits for the person; what is said then is painted too.

    Attributes
    ----------
    painted: `advice[s]`, int8, never changed in place; None before a world.
    steering: whether questions wait for the person.
    waiting: the `StateReward` that waits, or None.
    robot: the last `StateReward` that was asked in this run, or None.

    """

    def __init__(self):
        super().__init__()
        self.painted, self.steering, self.waiting, self.robot = None, False, None, None

    def attend(self, msg, grid):
        """Change into a mentor in this world; what was painted stays where the map is the same."""
        self.waiting, self.robot = None, None
        outputs = super().attend(msg, grid)
        if self.policy is None:
            self._take(np.full(len(self.world.free), NO_ACTION, dtype=np.int8))
            outputs += self.release_held()
        return outputs

    def observe(self, msg):
        """Return the `Recommendation` for a state; none where it waits for the person."""
        if msg.run == self._attention.run and validate_state(msg, self.world) is None and (
                self.robot is None or step_id(msg) >= step_id(self.robot)):
            self.robot = msg
        if msg.terminated and self.waiting and step_id(msg) > step_id(self.waiting):
            self.waiting = None  # the learner went on without
        return super().observe(msg)

    def paint(self, cells):
        """
        Advise otherwise in some states, from the next question on.

        cells: table of actions by state, -1 for no advice.

        Raises
        ------
        ValueError: if there is no world yet, a state is outside of the grid or nobody can act in
            it, or the cell has no such action; then nothing changes.

        """
        policy = self._world_needed().copy()
        for state, action in cells.items():
            check_cell(state, action, self.world)
            policy[state] = action
        self._take(validate_policy(policy, self.world))

    def replace(self, policy):
        """
        Advise by `policy[s]` from the next question on, -1 for no advice.

        Raises
        ------
        ValueError: as for `paint`.

        """
        blank = np.full_like(self._world_needed(), NO_ACTION)
        policy = np.asarray(policy)
        if policy.shape != blank.shape:
            raise PolicyError(f'a policy must have the {len(blank)} states of the map, got an '
                              f'array of shape {policy.shape}')
        advised = np.flatnonzero(policy != NO_ACTION)
        for state in advised.tolist():
            check_cell(state, policy[state].item(), self.world)
        blank[advised] = policy[advised]
        self._take(validate_policy(blank, self.world))

    def steer(self, action):
        """
        Return the `Recommendation` in the state that waits, none where none does; paint it too.

        Raises
        ------
        ValueError: as for `paint`.

        """
        if self.waiting is None:
            return ()
        self.paint({self.waiting.state: action})
        return self._say(action)

    def give_up(self):
        """Return the `Recommendation` for the state that waits: no advice; nothing is painted."""
        return self._say(NO_ACTION) if self.waiting else ()

    def take_the_wheel(self, wanted):
        """Steer from now on, or not; return what is to be said about the state that waits."""
        self.steering = wanted
        if wanted or self.waiting is None:
            return ()
        return self._say(self.policy[self.waiting.state])

    def _take(self, policy):
        policy.flags.writeable = False
        self.painted, self.policy = policy, policy.tolist()

    def _world_needed(self):
        if self.painted is None:
            raise PolicyError('a policy must be for a world, and none is known yet')
        return self.painted

    def _advise(self, msg):
        """Return the `Recommendation` for a state, the same for one that is repeated."""
        if self._asked and step_id(msg) == step_id(self._asked):
            return self._answer
        if self._asked and step_id(msg) < step_id(self._asked):
            return (self._turns.too_late(step_id(msg)),)
        if self.waiting is None or step_id(msg) > step_id(self.waiting):
            self.waiting = msg
        return () if self.steering else self._say(self.policy[msg.state])

    def _say(self, action):
        """Return the `Recommendation` in the state that waits."""
        msg, self.waiting, self._looks = self.waiting, None, 0
        self._turns.take(msg)
        self.turns, self._asked, self._attention.committed = self.turns + 1, msg, True
        self._answer = (Recommendation(*msg[:4], action),)
        return self._answer


def check_cell(state, action, world):
    """
    Return if advice can be painted in a state; whether it leads out of the grid is not checked.

    Raises
    ------
    PolicyError: if there is no such state or action, or nobody can act there.

    """
    states = len(world.free)
    if type(state) is not int or not 0 <= state < states:
        raise PolicyError(f'a state must lie in [0, {states - 1}], got {state!r}')
    if type(action) is not int or not NO_ACTION <= action < 4:
        raise PolicyError('an action must be 0 left, 1 right, 2 down, 3 up, or -1 for no advice, '
                          f'got {action!r}')
    if action != NO_ACTION and not world.free[state]:
        raise PolicyError('a policy has advice in free cells only, got some in state '
                          f'{state} at {world.grid.place(state)}')
