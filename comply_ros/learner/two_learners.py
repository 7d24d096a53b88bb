# SPDX-License-Identifier: Apache-2.0
"""Two learners in one process that teach each other."""

from __future__ import annotations

from comply_ros.learner.agent import IterationResult, no_advice
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.world.mdp import World


class TwoLearners:
    """
    Two trainings, each the mentor of the other by the policy that it has learned so far.

    They begin without advice. After each iteration each takes the policy of the other as the
    advice of the next one, -1 where that has learned nothing. Each has a copy of the world.

    Parameters
    ----------
    world: the world of both.
    config: the settings of both.
    seeds: of the two.

    Attributes
    ----------
    trainings: the two.

    """

    def __init__(self, world: World, config: LearnerConfig, seeds: tuple[int, int]) -> None:
        self._mentors = [AdviceBudget(world, no_advice(world)) for _ in seeds]
        self.trainings = [Training(world, mentor, config, seed)
                          for mentor, seed in zip(self._mentors, seeds)]

    def iterate(self) -> list[IterationResult]:
        """Play one mini-batch of episodes with each, exchange the policies, return the results."""
        results = [training.iterate() for training in self.trainings]
        policies = [training.learned().policy for training in self.trainings]
        for mentor, policy in zip(self._mentors, reversed(policies)):
            mentor.policy[:] = policy
        return results
