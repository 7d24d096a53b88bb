# SPDX-License-Identifier: Apache-2.0
"""Ways over the cells of a map, until an edge, an obstacle or a wall is in the way."""

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.cell_rules import CellRules
from comply_ros.world.grid import OBSTACLE

BUMPED_NOT, BUMPED_EDGE, BUMPED_OBSTACLE, BUMPED_WALL = range(4)

States = NDArray[np.int64]


class CellWalk:
    """What is in the way on a map."""

    def __init__(self, rules: CellRules) -> None:
        self._width, self._height = rules.width, rules.height
        self._obstacle = rules.is_cell(OBSTACLE)
        self._wall_right = np.zeros((rules.height, rules.width), dtype=bool)
        self._wall_above = np.zeros((rules.height, rules.width), dtype=bool)
        for x, y, x2, y2 in rules.walls:
            if x == x2 and x > 0:
                self._wall_right[min(y, y2):max(y, y2), x - 1] = True
            elif y == y2 and y > 0:
                self._wall_above[y - 1, min(x, x2):max(x, x2)] = True

    def walk(self, s: States, dx: States, dy: States) -> tuple[States, NDArray[np.int64]]:
        """
        Return where so many cells lead, and what was bumped into first.

        First along the row, then along the column. A diagonal step must be free both ways.
        """
        target, bump = self._walk_along(*self._walk_along(s, None, dx, 0), dy, 1)
        diagonal = (np.abs(dx) == 1) & (np.abs(dy) == 1)
        if diagonal.any():
            _, other = self._walk_along(*self._walk_along(s, None, dy, 1), dx, 0)
            blocked = diagonal & (np.maximum(bump, other) > BUMPED_EDGE)
            target = np.where(blocked, s, target)
            bump = np.where(blocked & (bump == BUMPED_NOT), other, bump)
        return target, bump

    def _walk_along(self, s: States, bump: NDArray[np.int64] | None, count: States, axis: int,
                    ) -> tuple[States, NDArray[np.int64]]:
        """Return where so many cells along an axis lead (0: x, 1: y), and what was hit first."""
        first = np.zeros(len(s), dtype=np.int64) if bump is None else bump
        here, going = s.copy(), np.ones(len(s), dtype=bool)
        for k in range(int(np.abs(count).max(initial=0))):
            going = going & (np.abs(count) > k)
            ahead, hit = self._ahead(here, np.sign(count), axis)
            first = np.where(going & (hit != BUMPED_NOT) & (first == BUMPED_NOT), hit, first)
            going &= hit == BUMPED_NOT
            here = np.where(going, ahead, here)
        return here, first

    def _ahead(self, s: States, sign: States, axis: int) -> tuple[States, NDArray[np.int64]]:
        """Return the next cell along an axis, and what is in the way of it."""
        width, height = self._width, self._height
        x, y = s % width, s // width
        x2, y2 = (x + sign, y) if axis == 0 else (x, y + sign)
        inside = (0 <= x2) & (x2 < width) & (0 <= y2) & (y2 < height)
        ahead = np.where(inside, y2 * width + x2, s)
        lower = np.minimum(s, ahead)  # the left or lower one of the two cells
        walls = self._wall_right if axis == 0 else self._wall_above
        hit = np.where(walls.ravel()[lower] & (sign != 0), BUMPED_WALL,
                       np.where(self._obstacle[ahead], BUMPED_OBSTACLE, BUMPED_NOT))
        return ahead, np.where(inside, hit, BUMPED_EDGE)
