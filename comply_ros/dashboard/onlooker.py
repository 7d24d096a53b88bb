# SPDX-License-Identifier: Apache-2.0
"""One that hears a whole lesson and says nothing: what the page shows."""

from collections import OrderedDict
from typing import NamedTuple

import numpy as np

from comply_ros.core.attendant import Attendant
from comply_ros.core.dialogue import Action, Episode, Progress, StateReward, WorldDescription
from comply_ros.core.problems import problem_of_state
from comply_ros.core.turns import FIRST
from comply_ros.core.world import World
from comply_ros.dashboard.curve import Curve
from comply_ros.nodes.observer import can_advise, can_be

RUNS = 8  # whose reports are remembered while it is open which one is attended to


class Heard(NamedTuple):
    """
    What was heard of one run; None for what was not.

    Attributes
    ----------
    advice, policy: `a[s]`, int8, of the mentor and of the learner.
    trust: `p[s]`, float32.

    """

    question: StateReward = None
    answer: Action = None
    episode: Episode = None
    progress: Progress = None
    curve: Curve = Curve()
    advice: np.ndarray = None
    policy: np.ndarray = None
    trust: np.ndarray = None


class Sight(NamedTuple):
    """A lesson at one moment: the world, None before it is known, and what was heard of it."""

    described: WorldDescription = None
    world: World = None
    heard: Heard = Heard()


class Onlooker(Attendant):
    """
    Attends to one world as a mentor does, and keeps the newest report of each kind.

    Attributes
    ----------
    world: the `World` that is attended to, None before.

    """

    def __init__(self):
        super().__init__()
        self.world, self._runs = None, OrderedDict()

    @property
    def sight(self):
        """The `Sight` of the run that is attended to; what cannot be right is left out."""
        if self.described is None:
            return Sight()
        return Sight(self.described, self.world, self._runs.get(self.described.run, Heard()))

    def attend(self, said, grid):
        """Change into an onlooker of this world; return nothing to say."""
        held = self._attention.attend(said)
        if self.world is None or self.world.grid != grid:
            self.world = World(grid)
        heard, self._runs = self._runs.get(said.run), OrderedDict()
        if heard:
            self._runs[said.run] = self._checked(heard)
        for hear, message in held:
            hear(message)
        return ()

    def hear_state(self, said):
        """Take a state for the newest question."""
        attention = self._attention
        if said.run != attention.run:
            attention.hold(self.hear_state, said, 'a state')
            return
        attention.refuse_held()
        attention.silent = 0
        attention.committed |= (said.episode, said.step) != FIRST
        if not problem_of_state(said, self.world):
            self._remember(said.run, question=said)

    def hear_action(self, said):
        """Take an action for the newest answer."""
        self._remember(said.run, answer=said)

    def hear_episode(self, said):
        """Take how an episode went for the newest report of one."""
        self._remember(said.run, episode=said)

    def hear_progress(self, said):
        """Add an iteration to the curve."""
        if can_be(said):
            curve = self._runs.get(said.run, Heard()).curve
            self._remember(said.run, progress=said, curve=curve.after(said))

    def hear_trust(self, said):
        """Take the trust in every state."""
        self._remember(said.run, trust=np.array(said.confidence, dtype=np.float32))

    def hear_policy(self, said):
        """Take the learner's action in every state."""
        self._remember(said.run, policy=np.array(said.action, dtype=np.int8))

    def hear_advice(self, said):
        """Take the mentor's action in every state."""
        self._remember(said.run, advice=np.array(said.action, dtype=np.int8))

    def _remember(self, run, **news):
        """Change what is known of a run by news; of too many runs the oldest is forgotten."""
        heard = self._runs.get(run, Heard())._replace(**news)
        self._runs[run] = self._checked(heard) if run == self._attention.run else heard
        if len(self._runs) > RUNS:
            self._runs.pop(next(each for each in self._runs if each != self._attention.run))

    def _checked(self, heard):
        """Return what was heard without the maps that cannot be of this world."""
        maps = {name: getattr(heard, name) for name in ('advice', 'policy')}
        wrong = dict.fromkeys((name for name, actions in maps.items() if actions is not None
                               and not can_advise(actions, self.world)))
        if heard.trust is not None and not _can_be_trust(heard.trust, self.world):
            wrong['trust'] = None
        return heard._replace(**wrong) if wrong else heard


def _can_be_trust(trust, world):
    return trust.shape == world.free.shape and bool(((0.0 <= trust) & (trust <= 1.0)).all())
