# SPDX-License-Identifier: Apache-2.0
"""The learning curve of one run, thinned out as it grows."""

from typing import NamedTuple

LONGEST = 2000  # points that are kept; of more, every second one is forgotten


class Curve(NamedTuple):
    """Iterations, ascending, and the mean return in each."""

    iterations: tuple = ()
    returns: tuple = ()

    def after(self, msg):
        """
        Curve that ends with a `Progress`.

        What is there from its iteration on goes: a learner that was reset says them again.
        """
        kept = len(self.iterations)
        while kept and self.iterations[kept - 1] >= msg.iteration:
            kept -= 1
        longer = Curve((*self.iterations[:kept], msg.iteration),
                       (*self.returns[:kept], msg.mean_return))
        return longer if kept < LONGEST else longer.thinned()

    def thinned(self):
        """Curve of every second point, the newest one among them."""
        first = 1 - len(self.iterations) % 2
        return Curve(self.iterations[first::2], self.returns[first::2])
