# SPDX-License-Identifier: Apache-2.0
"""What a viewer knows of the conversation, and what of it has changed since it was shown."""

import numpy as np

from comply_ros.core.attendant import Attendant
from comply_ros.core.dialogue import Notice, Refused
from comply_ros.core.grid import NO_ACTION
from comply_ros.core.problems import problem_of_state
from comply_ros.core.world import World

TRUST, MENTOR, POLICY, VALUES = MAPS = ('trust', 'mentor_policy', 'policy', 'values')
WORLD, ROBOT = 'world', 'robot'
RUNS = 4  # other runs of which maps are remembered, since they can come before their world


class Scene(Attendant):
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

    def waits_for(self):
        """Text of what it misses before there is anything to show, or None."""
        return self._attention.waits_for() if self.world is None else None

    def attend(self, said, grid):
        """Change into one that shows this world; return a `Notice`, and what came early."""
        held = self._attention.attend(said)
        self.world, self.trail, self._last = World(grid), [], None
        self.changed = {WORLD, ROBOT, *MAPS}
        return (Notice(f'shows world {said.name!r}, run {said.run}'),
                *(each for hear, message in held for each in hear(message)))

    def hear_state(self, said):
        """Change the trail by a state; return what could not be right."""
        if said.run != self.run:
            return self._attention.hold(self.hear_state, said, 'a state')
        problem = problem_of_state(said, self.world)
        if problem:
            return (problem,)
        self._attention.silent, self._attention.committed = 0, True
        if (said.episode, said.step) != self._last:
            self._walk(said)
        return ()

    def _walk(self, said):
        """Change the trail: it goes on in this episode, and begins anew in another."""
        here, before = (said.episode, said.step), self._last
        self._last = here
        self.changed.add(ROBOT)
        if before is None or before[0] != here[0] or here < before:
            self.trail = []
        if not self.trail or self.trail[-1] != said.state:
            self.trail = [*self.trail[-self._longest + 1:], said.state] \
                if self._longest > 1 else [said.state]

    def hear_map(self, name, said):
        """Remember a map over all states; one of another run until its world is there."""
        runs = self._maps.setdefault(name, {})
        runs.pop(said.run, None)
        runs[said.run] = said
        others = [run for run in runs if run != self.run]
        if len(others) > RUNS:
            del runs[others[0]]
        if said.run == self.run:
            self.changed.add(name)

    def map(self, name):
        """
        Array over all states of a map of this run, None where none was heard.

        Raises
        ------
        ValueError: if it is no map of this world.

        """
        said = self._maps.get(name, {}).get(self.run)
        if said is None:
            return None
        check = {TRUST: _check_trust, VALUES: _check_values}.get(name, _check_policy)
        grid, array = self.world.grid, np.array(said[-1])
        if (said.width, said.height) != (grid.width, grid.height) or \
                len(array) != grid.width * grid.height:
            raise ValueError(f'{name} must have {grid.width} x {grid.height} states, got '
                             f'{len(array)} of {said.width} x {said.height}')
        check(name, array, self.world)
        return array


def refused_map(name, error):
    """`Refused` of a map that cannot be one of this world."""
    return Refused(f'{name} of another shape or content', str(error))


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
