# SPDX-License-Identifier: Apache-2.0
"""Tiny worlds whose numbers can be worked out by hand, and learners in them."""

from comply_ros.learner.belief_update import update_belief
from comply_ros.learner.confidence import confidence
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.learner_state import LearnerState
from comply_ros.world.grid import Grid, RIGHT
from comply_ros.world.mdp import World


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
        self.method = LearnerConfig(**settings)
        self.numbers = self.method.numbers()
        self.memory = LearnerState.fresh(world, self.method)
        self.arrays = self.memory.arrays()

    def confidence(self, as_run, s=4, advice=RIGHT, step=0):
        """Return the confidence in the advice in state s, at a step of the episode."""
        q, visits, belief, arrivals, schedule, *_ = self.arrays
        return as_run(confidence)(s, advice, step, self.numbers, q, visits, belief, arrivals,
                                  schedule)

    def update_belief(self, as_run, a, delta, s=4):
        """Change the belief by a step with action a in state s, where RIGHT was advised."""
        memory = self.memory
        as_run(update_belief)(s, a, RIGHT, delta, self.numbers, memory.q, memory.belief,
                              memory.schedule)
