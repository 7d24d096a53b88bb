# SPDX-License-Identifier: Apache-2.0
"""Tiny worlds whose numbers can be worked out by hand, and learners in them."""

from comply_ros.core.grid import Grid
from comply_ros.core.memory import Memory
from comply_ros.core.method import Method
from comply_ros.core.world import World


def grid(*rows, starts=(0,), step=-1.0, obstacle=-5.0, goal=10.0, intended=0.8, limit=50):
    """Return a small grid; rows top first."""
    return Grid(tuple(rows), tuple(starts), step, obstacle, goal, intended, limit)


def corridor(**settings):
    """Return three cells in a row, the goal on the right: states 0, 1, 2."""
    return World(grid('..G', **settings))


def room(**settings):
    """Return nine cells, the goal in the upper right corner; state 4 in the middle has it all."""
    return World(grid('..G', '...', '...', **settings))


class Bench:
    """One method and its memory in a small world, with the arguments that kernels take."""

    def __init__(self, world, **settings):
        self.method = Method(**settings)
        self.numbers = self.method.numbers()
        self.memory = Memory.fresh(world, self.method)
        self.arrays = self.memory.arrays()
