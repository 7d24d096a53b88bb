# SPDX-License-Identifier: Apache-2.0
"""The iterations of a learner that reports none, from the episodes that the world reports."""

from math import nan

from comply_ros.numerics.summation import mean_in_order
from comply_ros.protocol.messages import Episode, Progress


class IterationCounter:
    """
    Counts the episodes of one run.

    Parameters
    ----------
    iterations: to count before the training is finished.
    episodes: of an iteration.

    """

    def __init__(self, iterations: int, episodes: int) -> None:
        self._iterations, self._episodes = iterations, episodes
        self._steps, self._returns = 0, list[float]()

    def missing_before(self, msg: Episode) -> int:
        """Return how many episodes before this one were not counted."""
        return max(0, msg.episode - len(self._returns) - 1)

    def add(self, msg: Episode) -> Progress | None:
        """Count an episode, if it is the next one; return the iteration that ends with it."""
        if msg.episode != len(self._returns) + 1:
            return None
        self._returns.append(msg.total_reward)
        self._steps += msg.steps
        iteration, rest = divmod(msg.episode, self._episodes)
        if rest or iteration > self._iterations:
            return None
        mean = mean_in_order(self._returns[-self._episodes:])
        return Progress(msg.run, iteration, self._iterations, self._episodes, self._steps, mean,
                        nan, 0.0, iteration == self._iterations)
