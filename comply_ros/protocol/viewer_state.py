# SPDX-License-Identifier: Apache-2.0
"""What a viewer knows of the conversation, and what of it has changed since it was shown."""

import numpy as np

from comply_ros.protocol.attendant import Attendant
from comply_ros.protocol.messages import Notice, Rejected
from comply_ros.protocol.validation import validate_state
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World

TRUST, MENTOR, POLICY, VALUES = MAPS = ('trust', 'mentor_policy', 'policy', 'values')
WORLD, ROBOT = 'world', 'robot'
RUNS = 4  # other runs of which maps are remembered, since they can come before their world


class ViewerState(Attendant):
    """
    Hears all that is said, answers nothing, and remembers what of it is to be shown anew.

    Parameters
    ----------
    longest: states of the episode that the trail has at most.

    Attributes
    ----------
    world: the `World` that is attended to, None before.
    trail: states of this episode, oldest first, each different from the one before.
    changed: names among WORLD, ROBOT and MAPS of what changed; who shows it clears it.

    """

    def __init__(self, longest):
        super().__init__()
        self.world, self.trail, self.changed = None, [], set()
        self._longest, self._maps, self._last = longest, {}, None

    @property
    def run(self):
        """Number of the run that is attended to, None before."""
        return self._attention.run

    def waiting_for(self):
        """Text of what it misses before there is anything to show, or None."""
        return self._attention.waiting_for() if self.world is None else None

    def attend(self, msg, grid):
        """Change into one that shows this world; return a `Notice`, and what came early."""
        held = self._attention.attend(msg)
        self.world, self.trail, self._last = World(grid), [], None
        self.changed = {WORLD, ROBOT, *MAPS}
        return (Notice(f'shows world {msg.name!r}, run {msg.run}'),
                *(each for hear, message in held for each in hear(message)))

    def observe(self, msg):
        """Change the trail by a state; return what could not be right."""
        if msg.run != self.run:
            return self._attention.hold(self.observe, msg, 'a state')
        problem = validate_state(msg, self.world)
        if problem:
            return (problem,)
        self._attention.silent, self._attention.committed = 0, True
        if (msg.episode, msg.step) != self._last:
            self._walk(msg)
        return ()

    def _walk(self, msg):
        """Change the trail: it goes on in this episode, and begins anew in another."""
        here, before = (msg.episode, msg.step), self._last
        self._last = here
        self.changed.add(ROBOT)
        if before is None or before[0] != here[0] or here < before:
            self.trail = []
        if not self.trail or self.trail[-1] != msg.state:
            self.trail = [*self.trail[-self._longest + 1:], msg.state] \
                if self._longest > 1 else [msg.state]

    def on_state_map(self, name, msg):
        """Remember a map over all states; one of another run until its world is there."""
        runs = self._maps.setdefault(name, {})
        runs.pop(msg.run, None)
        runs[msg.run] = msg
        others = [run for run in runs if run != self.run]
        if len(others) > RUNS:
            del runs[others[0]]
        if msg.run == self.run:
            self.changed.add(name)

    def map(self, name):
        """
        Array over all states of a map of this run, None where none was heard.

        Raises
        ------
        ValueError: if it is no map of this world.

        """
        msg = self._maps.get(name, {}).get(self.run)
        if msg is None:
            return None
        check = {TRUST: _check_trust, VALUES: _check_values}.get(name, _check_policy)
        grid, array = self.world.grid, np.array(msg[-1])
        if (msg.width, msg.height) != (grid.width, grid.height) or \
                len(array) != grid.width * grid.height:
            raise ValueError(f'{name} must have {grid.width} x {grid.height} states, got '
                             f'{len(array)} of {msg.width} x {msg.height}')
        check(name, array, self.world)
        return array


def refused_map(name, error):
    """`Rejected` of a map that cannot be one of this world."""
    return Rejected(f'{name} of another shape or content', str(error))


def _check_trust(name, confidence, world):
    if not ((confidence >= 0.0) & (confidence <= 1.0)).all():  # nor is nan a confidence
        raise ValueError(f'{name} must lie in [0, 1], got '
                         f'{confidence[~((confidence >= 0.0) & (confidence <= 1.0))][0]}')


def _check_values(name, values, world):
    if not np.isfinite(values[world.free]).all():
        raise ValueError(f'{name} must be finite numbers, got '
                         f'{values[world.free & ~np.isfinite(values)][0]}')


def _check_policy(name, policy, world):
    known = (policy >= NO_ACTION) & (policy < 4)
    has = world.available[np.arange(len(policy)), np.where(known, policy, 0)]
    wrong = np.flatnonzero(~known | world.free & (policy != NO_ACTION) & ~has)
    if len(wrong):
        raise ValueError(f'{name} must be actions that the cells have, or -1, got '
                         f'{policy[wrong[0]]} in state {wrong[0]}')
