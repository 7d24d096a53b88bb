# SPDX-License-Identifier: Apache-2.0
"""How often outcomes of actions came, compared with the model of a world."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from math import erfc, exp, lgamma, log, sqrt

from comply_ros.world.mdp import World

ALPHA = 1e-4  # chance that a right world fails in any of the comparisons
LEAST = 25.0  # times that an outcome must be expected: with less, chi-squared is a poor bound


class OutcomeCounts:
    """
    Counts what actions led to.

    world: it has a model.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._counts: dict[tuple[int, int], Counter[tuple[int, float]]] = defaultdict(Counter)

    def add(self, s: int, a: int, s2: int, reward: float) -> None:
        """Count that action a in state s led to s2 and earned a reward."""
        self._counts[s, a][s2, reward] += 1

    def comparisons(self) -> Iterator[tuple[bool, str, str]]:
        """
        Yield for each comparison with the model whether it holds, what is expected, and what came.

        Each action of each state has a chi-squared test, in which outcomes that are rare are
        counted together; one more test is about all of them: how often the outcome that is most
        likely did not come.
        """
        level = ALPHA / (len(self._counts) + 1)
        missed, mean, variance = 0, 0.0, 0.0
        for (s, a), seen in self._counts.items():
            expected, total = outcomes(self._world, s, a), sum(seen.values())
            strange = [each for each in seen if each not in expected]
            yield (not strange, 'rewards and successors of the model: '
                   + ', '.join(map(str, expected)), f'{strange[:1]} in state {s}, action {a}')
            if strange:
                continue
            likely = max(expected, key=lambda each: expected[each])
            missed += total - seen[likely]
            mean += total * (1.0 - expected[likely])
            variance += total * expected[likely] * (1.0 - expected[likely])
            yield _tail_comparison(
                level, *chi_squared(seen, expected),
                f'successors as often as the model says, in state {s}, action {a}')
        if variance > LEAST:
            yield _tail_comparison(
                level, (missed - mean) ** 2 / variance, 1,
                f'{mean:.0f} steps that do not lead where they usually do, and not {missed}')


def _tail_comparison(level: float, statistic: float, degrees: int,
                     expected: str) -> tuple[bool, str, str]:
    tail = chi_squared_tail(statistic, degrees)
    return tail >= level, expected, f'chi-squared {statistic:.1f}: chance {tail:.1e}'


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
