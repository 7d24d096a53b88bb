# SPDX-License-Identifier: Apache-2.0
"""Metrics of a training: time to convergence and reward ratio (section 4.3.1), and regret."""

from collections.abc import Sequence

from comply_ros.numerics.summation import sum_in_order

CLOSE = 0.99  # share of the optimal return that counts as converged (section 4.3.1)
PUBLISHED_OPTIMAL = 5.8386  # the optimal return as the published runs measured it in their maze
PUBLISHED_THRESHOLD = 4.9 / PUBLISHED_OPTIMAL


def threshold(profile: str, optimal_return: float) -> float:
    """
    Mean return of an iteration above which a learner counts as converged.

    `report`: 99 % of the optimal return. `published`: 4.9 in `maze`, and as near to the optimal
    return on any other map; below it by the same share where the optimal return is negative.
    """
    share = CLOSE if profile == 'report' else PUBLISHED_THRESHOLD
    return optimal_return - (1.0 - share) * abs(optimal_return)


def time_to_convergence(profile: str, returns: Sequence[float], level: float) -> int | None:
    """
    Return the iterations until the learner has converged, or None if it never does.

    `report`: after this number the return stays above the level. `published`: the number of
    iterations at or below the level, wherever they are.
    """
    below = [number for number, value in enumerate(returns, 1) if value <= level]
    if profile == 'published':
        return len(below)
    last = below[-1] if below else 0
    return last if last < len(returns) else None


def reward_ratio(returns: Sequence[float], convergence: int | None,
                 optimal_return: float) -> float | None:
    """
    Return collected until convergence over what the optimal policy collects in that time.

    Over all iterations where there is no convergence. None where it takes no iteration, or where
    the optimal policy collects nothing or less, since the ratio has no meaning then.
    """
    collected = returns[:convergence]
    optimal = optimal_return * len(collected)
    return sum_in_order(collected) / optimal if optimal > 0 else None


def regret(returns: Sequence[float], optimal_return: float) -> float:
    """Sum over the iterations of the optimal return minus the return."""
    return sum_in_order(optimal_return - value for value in returns)
