# SPDX-License-Identifier: Apache-2.0
"""What a pointer paints on its way over the cells."""

from comply_ros.world.grid import DOWN, LEFT, NO_ACTION, RIGHT, STEPS, UP

FOLLOW = 'follow'  # the tool whose arrows point where the pointer goes
TURNS = (NO_ACTION, UP, RIGHT, DOWN, LEFT)  # what clicks on a cell go through


class PaintTool:
    """
    Turns presses and moves of a pointer into arrows, as tables from state to action.

    Attributes
    ----------
    tool: FOLLOW, an action, or -1 to erase.

    """

    def __init__(self):
        self.tool, self._last, self._way = FOLLOW, None, 0

    def press(self, world, s):
        """Begin a stroke in state s (None: outside); return what it paints."""
        self._last, self._way = s, 0
        return {} if s is None or self.tool == FOLLOW else _painted(world, {s: self.tool})

    def move(self, world, s):
        """Go on to state s; return what is painted on the way, no cell left out."""
        if None in (s, self._last) or s == self._last:
            return {}
        painted = {}
        for here, action, there in steps_between(world.grid, self._last, s):
            painted.update({here: action, there: action} if self.tool == FOLLOW
                           else {there: self.tool})
        self._way += 1
        self._last = s
        return _painted(world, painted)

    def lift(self, world, policy):
        """End the stroke; return what a click paints, if it was one: the cell's arrow turns."""
        s, moved = self._last, self._way
        self._last = None
        if s is None or moved or self.tool != FOLLOW or not world.free[s]:
            return {}
        after = TURNS.index(int(policy[s])) + 1
        return {s: next(a for a in (*TURNS[after:], *TURNS[:after]) if _has(world, s, a))}

    @property
    def paints(self):
        """Whether a stroke is going on."""
        return self._last is not None


def steps_between(grid, s, s2):
    """Yield (state, action, state) of a way from s to s2, across and up alike."""
    (x, y), (x2, y2) = grid.place(s), grid.place(s2)
    while (x, y) != (x2, y2):
        across = abs(x2 - x) >= abs(y2 - y)
        action = (RIGHT if x2 > x else LEFT) if across else (UP if y2 > y else DOWN)
        here = y * grid.width + x
        x, y = x + STEPS[action][0], y + STEPS[action][1]
        yield here, action, y * grid.width + x


def _painted(world, cells):
    """Return those of the arrows that their cells can have."""
    return {s: a for s, a in cells.items() if world.free[s] and _has(world, s, a)}


def _has(world, s, a):
    return a == NO_ACTION or bool(world.successor[s, a] >= 0)
