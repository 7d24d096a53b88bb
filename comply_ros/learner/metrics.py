# SPDX-License-Identifier: Apache-2.0
"""How fast and how well a learner learned: section 4.3.1, and the regret."""

from comply_ros.numerics.summation import sum_in_order

CLOSE = 0.99  # share of the optimal return that counts as converged (section 4.3.1)
PUBLISHED_OPTIMAL = 5.8386  # the optimal return as the published runs measured it in their maze
PUBLISHED_THRESHOLD = 4.9 / PUBLISHED_OPTIMAL


def threshold(profile, optimal_return):
    """
    Mean return of an iteration above which a learner counts as converged.

    `report`: 99 % of the optimal return. `published`: 4.9 in `maze`, and as near to the optimal
    return on any other map; below it by the same share where the optimal return is negative.
    """
    share = CLOSE if profile == 'report' else PUBLISHED_THRESHOLD
    return optimal_return - (1.0 - share) * abs(optimal_return)


def time_to_convergence(profile, returns, level):
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


def reward_ratio(returns, convergence, optimal_return):
    """
    Return collected until convergence over what the optimal policy collects in that time.

    Over all iterations where there is no convergence; None where it takes no time at all, or the
    optimal policy collects nothing or less, where a share of it means nothing.
    """
    collected = returns[:convergence]
    optimal = optimal_return * len(collected)
    return sum_in_order(collected) / optimal if optimal > 0 else None


def regret(returns, optimal_return):
    """Sum over the iterations of what is missing to the optimal return."""
    return sum_in_order(optimal_return - value for value in returns)
