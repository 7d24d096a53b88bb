# SPDX-License-Identifier: Apache-2.0
"""What a learner and a mentor share: to hear of worlds, and to attend to one of them."""

from comply_ros.core.attention import Attention
from comply_ros.core.dialogue import grid_of
from comply_ros.core.problems import problem_of_world


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

    def hear_world(self, said):
        """
        Return what is to be said about a world, and about what came before it.

        The first world is attended to; see `Attention` for another one.

        Raises
        ------
        ValueError: if it cannot be a world.

        """
        here = self.described
        if here and said.run == here.run:
            self._attention.silent = 0
            return problem_of_world(said, here)
        grid = grid_of(said)
        return self.attend(said, grid) if self._attention.prefers(said) else ()

    def look(self):
        """Return what is to be said if the world is silent and another asks; once a second."""
        instead = self._attention.look()
        return self.attend(instead, grid_of(instead)) if instead else ()
