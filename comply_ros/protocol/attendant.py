# SPDX-License-Identifier: Apache-2.0
"""What a learner and a mentor share: to hear of worlds, and to attend to one of them."""

from comply_ros.protocol.attention import Attention
from comply_ros.protocol.messages import grid_from_description
from comply_ros.protocol.validation import validate_same_world


class Attendant:
    """
    One that attends to one world at a time; `attend(said, grid)` is what it does about a new one.

    Attributes
    ----------
    told: what it was told that matters later, to be kept before an answer is said.
    begins: True when its state does not follow from what it was told, and is to be kept whole.

    """

    def __init__(self):
        self._attention, self.told, self.begins = Attention(), [], False

    @property
    def described(self):
        """The `WorldDescription` of the world that is attended to, None before."""
        return self._attention.described

    def on_world(self, msg):
        """
        Return what is to be said about a world, and about what came before it.

        The first world is attended to; see `Attention` for another one.

        Raises
        ------
        ValueError: if it cannot be a world.

        """
        here = self.described
        if here and msg.run == here.run:
            self._attention.silent = 0
            return validate_same_world(msg, here)
        grid = grid_from_description(msg)
        return self.attend(msg, grid) if self._attention.prefers(msg) else ()

    def look(self):
        """Return what is to be said if the world is silent and another asks; once a second."""
        instead = self._attention.look()
        return self.attend(instead, grid_from_description(instead)) if instead else ()
