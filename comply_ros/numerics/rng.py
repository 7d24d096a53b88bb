# SPDX-License-Identifier: Apache-2.0
"""Random numbers: independent streams from one seed, and rows of uniforms from a stream."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

SEED_LIMIT = 2 ** 53  # every seed up to it survives a file, a float and a parameter
BLOCK = 4096  # rows drawn at once for a compiled loop; it changes the speed, not the numbers
ROW_BLOCK = 256  # rows drawn at once for `row`: as fast as more, and no call takes long


def random_streams(seed: int) -> list[np.random.Generator]:
    """Return the generators of the world and of the learner, independent, from one seed."""
    return [np.random.Generator(np.random.PCG64(child))
            for child in np.random.SeedSequence(seed).spawn(2)]


class UniformRows:
    """
    Rows of uniforms from a generator. Row n belongs to the n-th observation, used or not.

    Parameters
    ----------
    generator: the random stream.
    width: uniforms in a row.

    Attributes
    ----------
    used: number of rows that `row` has returned.

    """

    def __init__(self, generator: np.random.Generator, width: int) -> None:
        self._generator, self._width = generator, width
        self._block: NDArray[np.float64] = np.empty((0, width))
        self._rows: Iterator[list[float]] = iter(())
        self.used = 0

    def row(self) -> list[float]:
        """Return the next row."""
        self.used += 1
        for row in self._rows:
            return row
        self._rows = iter(self._generator.random((ROW_BLOCK, self._width)).tolist())
        return next(self._rows)

    def skip_to(self, used: int) -> None:
        """Continue after that number of rows; of this object none was used yet."""
        bits = self._generator.bit_generator
        assert isinstance(bits, np.random.PCG64)
        bits.advance(used * self._width)
        self.used = used

    def block(self) -> NDArray[np.float64]:
        """Return the next rows, `[row, number]`, without using them up."""
        if not len(self._block):
            self._block = self._generator.random((BLOCK, self._width))
        return self._block

    def use(self, count: int) -> None:
        """Use up the first rows of the block."""
        self._block = self._block[count:]
