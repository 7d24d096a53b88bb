# SPDX-License-Identifier: Apache-2.0
"""How likely the outcomes of an action are by a model, and a test of how often they came."""

from __future__ import annotations

from collections import Counter, defaultdict
from math import erfc, exp, lgamma, log, sqrt

from comply_ros.world.mdp import World

LEAST = 25.0  # times that an outcome must be expected: with less, chi-squared is a poor bound


def chi_squared(seen: Counter[tuple[int, float]],
                expected: dict[tuple[int, float], float]) -> tuple[float, int]:
    """
    Return the statistic of counts against probabilities, and its degrees of freedom.

    Outcomes that are expected less than 25 times are counted together.
    """
    total = sum(seen.values())
    bins = [(seen[each], total * p) for each, p in expected.items() if total * p >= LEAST]
    rare = [(seen[each], total * p) for each, p in expected.items() if total * p < LEAST]
    rest = sum(count for count, _ in rare), sum(mean for _, mean in rare)
    if rest[1] >= LEAST:
        bins.append(rest)
    if len(bins) < 2:
        return 0.0, 0
    return sum((count - mean) ** 2 / mean for count, mean in bins), len(bins) - 1


def outcomes(world: World, s: int, a: int) -> dict[tuple[int, float], float]:
    """Return the probability of each (successor, reward) of an action; worlds with a model."""
    found: dict[tuple[int, float], float] = defaultdict(float)
    if world.model == 'table':
        table = world.table
        pair = s * world.n_actions + a
        for k in range(table.first[pair], table.first[pair + 1]):
            found[int(table.successor[k]), float(table.reward[k])] += table.probability[k]
        return dict(found)
    others = [b for b in range(world.n_actions) if b != a and world.slips[s, b]]
    intended = world.grid.intended if others else 1.0
    for b, p in ((a, intended), *((b, (1.0 - intended) / len(others)) for b in others)):
        if p > 0.0:
            found[int(world.successor[s, b]), float(world.reward[s, b])] += p
    return dict(found)


def chi_squared_tail(x: float, degrees: int) -> float:
    """
    Return the chance that a chi-squared variable is at least x.

    degrees: of freedom; with 0 the chance is 1.
    """
    if degrees == 0:
        return 1.0
    half, tail = (0.5, erfc(sqrt(x / 2.0))) if degrees % 2 else (1.0, exp(-x / 2.0))
    while half < degrees / 2.0:  # Q(a + 1, y) = Q(a, y) + y^a e^-y / Gamma(a + 1)
        tail += exp(half * log(x / 2.0) - x / 2.0 - lgamma(half + 1.0)) if x > 0.0 else 0.0
        half += 1.0
    return tail
