# SPDX-License-Identifier: Apache-2.0
"""One that hears a whole lesson and says nothing: what the page shows."""

from collections import OrderedDict
from typing import NamedTuple

import numpy as np

from comply_ros.dashboard.learning_curve import Curve
from comply_ros.nodes.run_monitor import is_valid_advice, is_valid_progress
from comply_ros.protocol.attendant import Attendant
from comply_ros.protocol.messages import Action, Episode, Progress, StateReward, WorldDescription
from comply_ros.protocol.turns import FIRST
from comply_ros.protocol.validation import validate_state
from comply_ros.world.mdp import World

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

    def attend(self, msg, grid):
        """Change into an onlooker of this world; return nothing to say."""
        held = self._attention.attend(msg)
        if self.world is None or self.world.grid != grid:
            self.world = World(grid)
        heard, self._runs = self._runs.get(msg.run), OrderedDict()
        if heard:
            self._runs[msg.run] = self._checked(heard)
        for hear, message in held:
            hear(message)
        return ()

    def observe(self, msg):
        """Take a state for the newest question."""
        attention = self._attention
        if msg.run != attention.run:
            attention.hold(self.observe, msg, 'a state')
            return
        attention.refuse_held()
        attention.silent = 0
        attention.committed |= (msg.episode, msg.step) != FIRST
        if not validate_state(msg, self.world):
            self._remember(msg.run, question=msg)

    def on_action(self, msg):
        """Take an action for the newest answer."""
        self._remember(msg.run, answer=msg)

    def on_episode(self, msg):
        """Take how an episode went for the newest report of one."""
        self._remember(msg.run, episode=msg)

    def on_progress(self, msg):
        """Add an iteration to the curve."""
        if is_valid_progress(msg):
            curve = self._runs.get(msg.run, Heard()).curve
            self._remember(msg.run, progress=msg, curve=curve.after(msg))

    def on_trust(self, msg):
        """Take the trust in every state."""
        self._remember(msg.run, trust=np.array(msg.confidence, dtype=np.float32))

    def on_policy(self, msg):
        """Take the learner's action in every state."""
        self._remember(msg.run, policy=np.array(msg.action, dtype=np.int8))

    def on_mentor_policy(self, msg):
        """Take the mentor's action in every state."""
        self._remember(msg.run, advice=np.array(msg.action, dtype=np.int8))

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
                               and not is_valid_advice(actions, self.world)))
        if heard.trust is not None and not _is_possible_trust(heard.trust, self.world):
            wrong['trust'] = None
        return heard._replace(**wrong) if wrong else heard


def _is_possible_trust(trust, world):
    return trust.shape == world.free.shape and bool(((0.0 <= trust) & (trust <= 1.0)).all())
