# SPDX-License-Identifier: Apache-2.0
"""Tiny worlds whose numbers can be worked out by hand, and learners in them."""

import numpy as np

from comply_ros.learner.belief_update import update_belief
from comply_ros.learner.confidence import confidence
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.learner_state import initial_state
from comply_ros.numerics.action_values import actions_for_kernels
from comply_ros.world.grid import Grid, RIGHT
from comply_ros.world.mdp import World

FOUR = actions_for_kernels(4)  # the actions of a grid, as kernels take their number


def grid(*rows, starts=(0,), step=-1.0, obstacle=-5.0, goal=10.0, intended=0.8, limit=50):
    """Return a small grid; rows top first."""
    return Grid(tuple(rows), tuple(starts), step, obstacle, goal, intended, limit)


def corridor(**settings):
    """Return three cells in a row, the goal on the right: states 0, 1, 2."""
    return World(grid('..G', **settings))


def room(**settings):
    """Return nine cells, the goal in the upper right corner; state 4 has all four moves."""
    return World(grid('..G', '...', '...', **settings))


def advised(*actions):
    """Return `advice[m]` of each mentor, -1 for none, as compiled kernels take it."""
    return np.array(actions)


class Bench:
    """
    The settings and the fresh state of a learner in a small world, as kernels take them.

    n_mentors: number of mentors whose advice it takes.
    """

    def __init__(self, world, n_mentors=1, **settings):
        self.config = LearnerConfig(**settings)
        self.kernel_config = self.config.for_kernels(world.n_actions, n_mentors)
        self.state = initial_state(world, self.config, n_mentors)

    def confidence(self, as_run, s=4, advice=RIGHT, step=0):
        """Return the confidence in the first mentor's advice in state s, at a step."""
        return as_run(confidence)(s, 0, advised(advice), step, self.kernel_config, self.state)

    def update_belief(self, as_run, a, delta, s=4, m=0):
        """Change the belief in mentor m by action a in state s, where it advised RIGHT."""
        as_run(update_belief)(s, a, m, RIGHT, delta, self.kernel_config, self.state)


def model_bench(**settings):
    """Return a bench in which 10 was earned, and 3 of 4 actions had their usual outcome."""
    bench = Bench(room(), learns_model=True, **settings)
    bench.state.pooled[:4] = [3.0, 4.0, 10.0, 10.0]  # p = (3 + 1) / (4 + 1) = 0.8
    return bench


def see(bench, a, *outcomes, s=4):
    """Change the model: action a had outcomes of (samples, successor, reward)."""
    bench.state.model[s, a, :len(outcomes)] = outcomes
    bench.state.visits[s, a] += sum(outcome[0] for outcome in outcomes)
