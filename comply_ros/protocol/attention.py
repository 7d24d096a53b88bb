# SPDX-License-Identifier: Apache-2.0
"""Which world a learner or a mentor attends to, where more than one may speak."""

from collections import OrderedDict

from comply_ros.protocol.messages import follows, Ignored
from comply_ros.protocol.validation import rejected_run

GONE = 5  # looks without a word after which one asks whether the world is still there
SILENCE = 2  # looks without a word after which another world may be attended to
ASKED = 2  # times that the other one must have asked meanwhile
RIVALS = 8  # other worlds that are remembered


class Attention:
    """
    One world at a time, and the first: another only when this one is silent and that one asks.

    The same world after a reset says itself which run it replaces, and is attended to at once.
    A world that was killed and comes back has a new run, if it keeps no state; a second world that
    was started by mistake has another run too. The first is silent, beside the second is not.

    Attributes
    ----------
    described: the `WorldDescription` of the world that is attended to, None before.
    silent: looks since it last spoke; to be set to 0 when it does.
    committed: whether something was said in its run, so that no other run is as good.

    """

    def __init__(self):
        self.described, self.silent, self.committed = None, 0, False
        self._rivals, self._asked = OrderedDict(), {}
        self.held = {}

    @property
    def run(self):
        """Number of the run that is attended to, None before."""
        return self.described and self.described.run

    def waiting_for(self):
        """Text of what is missing where the world has been silent for long, or None."""
        if self.described is None:
            return 'a world: is a grid_world running?'
        if self.silent < GONE:
            return None
        return (f'the next state of world {self.described.name!r}: is its grid_world running, '
                'and not paused?')

    def prefers(self, msg):
        """Return whether another world is to be attended to from now on; else remember it."""
        here = self.described
        if here is None or follows(msg, here):
            return True
        if msg.run == here.replaces:  # it came late
            return False
        if not self.committed and msg.began < here.began:
            return True
        self._rivals[msg.run] = msg
        if len(self._rivals) > RIVALS:
            self._asked.pop(self._rivals.popitem(last=False)[0], None)
        return False

    def attend(self, msg):
        """Attend to a world from now on; return what was held, as pairs (hear, message)."""
        self.described, self.silent, self.committed = msg, 0, False
        self._rivals.clear()
        self._asked.clear()
        held, self.held = self.held, {}
        return [(hear, message) for hear, (message, _) in held.items()]

    def hold(self, hear, msg, what):
        """
        Keep a message of another run for the world that it may belong to; return refusals.

        It is refused as soon as the world here goes on, or another takes its place.
        """
        if self.described and msg.run == self.described.replaces:
            return (Ignored('before a reset', f'dropped {what} of run {msg.run}, which ended '
                            'with a reset of its world'),)
        if msg.run in self._rivals:
            self._asked[msg.run] = self._asked.get(msg.run, 0) + 1
        before, self.held[hear] = self.held.get(hear), (msg, what)
        if before is None or before[0].run == msg.run or self.run is None:
            return ()
        return (rejected_run(before[0], self.run, what),)

    def refuse_held(self):
        """Return `Rejected` for all that was held: the world here goes on."""
        held, self.held = self.held, {}
        self._asked.clear()
        return tuple(rejected_run(msg, self.run, what) for msg, what in held.values())

    def look(self):
        """Return the `WorldDescription` to attend to instead, or None; once a second."""
        self.silent += 1
        if self.silent < SILENCE:
            return None
        asking = (run for run, times in self._asked.items() if times >= ASKED)
        return self._rivals.get(next(asking, None))
