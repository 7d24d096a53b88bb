# SPDX-License-Identifier: Apache-2.0
"""Holds the observations of a world while it is paused, stepped or paced."""

from comply_ros.protocol.messages import Outputs


class PauseGate:
    """
    Holds the outputs that follow an action, until they may be published. It changes no bits.

    Attributes
    ----------
    paused: whether only `step` releases outputs.
    paced: whether outputs wait for the next `tick` where it is not paused.
    held: the outputs that are held, empty where there are none.

    """

    def __init__(self) -> None:
        self.paused, self.paced = False, False
        self.held: Outputs = ()
        self._steps = 0  # requested while nothing was held

    def admit(self, outputs: Outputs) -> Outputs:
        """Return what may be published now, all or nothing; the rest is held."""
        if self._steps:
            self._steps -= 1
            return outputs
        if not (self.paused or self.paced):
            return outputs
        self.held = outputs
        return ()

    def restart(self, outputs: Outputs) -> Outputs:
        """Forget steps and what was held; return what may be published now, without a tick."""
        self._steps, self.held = 0, outputs if self.paused else ()
        return () if self.paused else outputs

    def pause(self, paused: bool) -> Outputs:
        """Pause, or continue; return what may be published now."""
        if paused == self.paused:
            return ()
        self.paused, self._steps = paused, 0
        return () if paused or self.paced else self._release()

    def step(self) -> Outputs:
        """Return what was held; where nothing was, the next outputs are not held."""
        if not self.held:
            self._steps += 1
        return self._release()

    def tick(self) -> Outputs:
        """Return what waited for a tick."""
        return () if self.paused else self._release()

    def pace(self, paced: bool) -> Outputs:
        """Wait for ticks from now on, or not; return what may be published now."""
        self.paced = paced
        return () if paced else self.tick()

    def _release(self) -> Outputs:
        held, self.held = self.held, ()
        return held
