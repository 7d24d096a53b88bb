# SPDX-License-Identifier: Apache-2.0
"""Random numbers as an argument: every state met takes the same number of them, used or not."""

import numpy as np

SEED_LIMIT = 2 ** 53  # every number up to it survives a file, a float and a parameter
BLOCK = 4096  # rows drawn at once; it does not change the numbers, only the speed


def random_streams(seed):
    """Return the generators of the world and of the learner, independent, from one seed."""
    return [np.random.Generator(np.random.PCG64(child))
            for child in np.random.SeedSequence(seed).spawn(2)]


class UniformRows:
    """
    Rows of uniforms from a generator: row n belongs to the n-th state met.

    Parameters
    ----------
    generator: `numpy.random.Generator`.
    width: uniforms in a row.

    Attributes
    ----------
    used: rows that were used up one by one.

    """

    def __init__(self, generator, width):
        self._generator, self._width = generator, width
        self._block = np.empty((0, width))
        self._rows, self.used = iter(()), 0

    def row(self):
        """Return the next row, as a list of floats."""
        self.used += 1
        for row in self._rows:
            return row
        self._rows = iter(self._generator.random((BLOCK, self._width)).tolist())
        return next(self._rows)

    def skip_to(self, used):
        """Change a fresh one, of which nothing was used, to go on after so many rows."""
        self._generator.bit_generator.advance(used * self._width)
        self.used = used

    def block(self):
        """Return the rows that come next, `[row, number]`, without using them up."""
        if not len(self._block):
            self._block = self._generator.random((BLOCK, self._width))
        return self._block

    def use(self, count):
        """Use up the first rows of the block."""
        self._block = self._block[count:]
