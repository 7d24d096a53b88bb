# SPDX-License-Identifier: Apache-2.0
"""The arrows that a pointer paints on its way over the cells."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.grid import DOWN, Grid, LEFT, NO_ACTION, RIGHT, STEPS, UP
from comply_ros.world.mdp import World

FOLLOW = 'follow'  # the tool whose arrows point where the pointer goes
CLICK_ORDER = (NO_ACTION, UP, RIGHT, DOWN, LEFT)  # the arrows of a cell that is clicked repeatedly


class PaintTool:
    """Turns a stroke of the pointer into arrows: tables of actions by state."""

    def __init__(self) -> None:
        self.tool: str | int = FOLLOW  # or an action, or -1 to erase
        self._last: int | None = None  # state of the pointer in this stroke
        self._pending: dict[int, int] = {}  # what a finger paints if it was not one of two
        self._moved = False

    @property
    def painting(self) -> bool:
        """Whether a stroke has begun and not ended."""
        return self._last is not None

    def press(self, world: World, s: int | None, touch: bool = False) -> dict[int, int]:
        """
        Begin a stroke in state s (None: outside the grid); return what it paints.

        touch: whether it is by a finger, which may be the first of two: it paints when it moves
            or leaves.

        """
        self._last, self._moved = s, False
        if s is None or self.tool == FOLLOW:
            return {}
        self._pending = possible(world, {s: self.tool})
        return {} if touch else self._take_pending()

    def cancel(self) -> None:
        """End the stroke without painting more: the finger scrolls the page."""
        self._last, self._pending = None, {}

    def move(self, world: World, s: int | None) -> dict[int, int]:
        """Continue the stroke to state s; return what it paints, without gaps."""
        if s is None or self._last is None or s == self._last:
            return {}
        arrows: dict[int, Any] = {}
        for here, action, there in steps_between(world.grid, self._last, s):
            arrows |= ({here: action, there: action} if self.tool == FOLLOW
                       else {there: self.tool})
        self._last, self._moved = s, True
        return {**self._take_pending(), **possible(world, arrows)}

    def release(self, world: World, policy: NDArray[np.int8]) -> dict[int, int]:
        """End the stroke; return what it paints if it was a click: the cell's next arrow."""
        s, self._last = self._last, None
        if s is None or self._moved or self.tool != FOLLOW or not world.free[s]:
            return self._take_pending()
        after = CLICK_ORDER.index(int(policy[s])) + 1
        return next(filter(None, (possible(world, {s: a}) for a in (
            *CLICK_ORDER[after:], *CLICK_ORDER[:after]))))

    def _take_pending(self) -> dict[int, int]:
        pending, self._pending = self._pending, {}
        return pending


def steps_between(grid: Grid, s: int, s2: int) -> Iterator[tuple[int, int, int]]:
    """Yield the moves (state, action, next state) of a way from s to s2, close to a line."""
    (x, y), (x2, y2) = grid.place(s), grid.place(s2)
    while (x, y) != (x2, y2):
        if abs(x2 - x) >= abs(y2 - y):
            action = RIGHT if x2 > x else LEFT
        else:
            action = UP if y2 > y else DOWN
        here = y * grid.width + x
        x, y = x + STEPS[action][0], y + STEPS[action][1]
        yield here, action, y * grid.width + x


def possible(world: World, arrows: dict[int, Any]) -> dict[int, int]:
    """Return those of the arrows that their cells can have."""
    return {s: a for s, a in arrows.items()
            if world.free[s] and (a == NO_ACTION or world.successor[s, a] >= 0)}
