# SPDX-License-Identifier: Apache-2.0
"""When the next question is asked: at once, on a tick of a rate, or step by step."""


class PauseGate:
    """
    Holds back what follows from an answer, and says when it may be said. It changes no bits.

    Attributes
    ----------
    paused: whether nothing is said but what a step lets out.
    ticks: whether what is not paused waits for a tick.
    held: what is held back, empty where nothing is.

    """

    def __init__(self):
        self.paused, self.ticks, self.held = False, False, ()
        self._steps = 0  # that nothing was held for yet

    def admit(self, outputs):
        """Return what may be said now, all or nothing; the rest is held."""
        if self._steps:
            self._steps -= 1
            return outputs
        if not (self.paused or self.ticks):
            return outputs
        self.held = outputs
        return ()

    def restart(self, outputs):
        """Forget what was held, and steps; return what may be said now, without a tick."""
        self._steps, self.held = 0, outputs if self.paused else ()
        return () if self.paused else outputs

    def pause(self, wanted):
        """Pause, or go on; return what may be said now."""
        if wanted == self.paused:
            return ()
        self.paused, self._steps = wanted, 0
        return () if wanted or self.ticks else self._release()

    def step(self):
        """Return what was held; where nothing is, the next is not held back: it is on its way."""
        if not self.held:
            self._steps += 1
        return self._release()

    def tick(self):
        """Return what waited for a tick."""
        return () if self.paused else self._release()

    def pace(self, ticks):
        """Wait for ticks from now on, or not; return what may be said now."""
        self.ticks = ticks
        return () if ticks else self.tick()

    def _release(self):
        held, self.held = self.held, ()
        return held
