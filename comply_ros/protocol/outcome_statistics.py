# SPDX-License-Identifier: Apache-2.0
"""How often outcomes of actions came, compared with the model of a world."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from math import erfc, exp, lgamma, log, sqrt

from comply_ros.world.mdp import World

ALPHA = 1e-4  # chance that a right world fails in any of the comparisons
RARE = 0.5  # largest probability of an outcome that is compared over all states
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
        counted together. Rare ones have tests of their own over all states: those of an action
        that lead as far, such as every slip to the left while going up; and those of any action
        that do. The distance is that of the numbers of the states.
        """
        strange = set()
        for (s, a), seen in self._counts.items():
            expected = outcomes(self._world, s, a)
            wrong = [each for each in seen if each not in expected]
            strange |= {(s, a)} if wrong else set()
            yield (not wrong, 'rewards and successors of the model: '
                   + ', '.join(map(str, expected)), f'{wrong[:1]} in state {s}, action {a}')
        counts = {pair: seen for pair, seen in self._counts.items() if pair not in strange}
        groups = self._rare_groups(counts)
        level = ALPHA / max(1, len(counts) + len(groups))
        for (s, a), seen in counts.items():
            statistic, degrees = chi_squared(seen, outcomes(self._world, s, a))
            tail = chi_squared_tail(statistic, degrees)
            yield (tail >= level, f'successors as often as the model says, in state {s}, action '
                   f'{a}', f'chi-squared {statistic:.1f}: chance {tail:.1e}')
        for (distance, a), (count, mean) in groups.items():
            tail = count_tail(count, mean)
            by = 'any action' if a is None else f'action {a}'
            yield (tail >= level, f'{mean:.1f} times a state whose number is {distance:+d}, where '
                   f'{by} seldom leads there', f'{count} times: chance at most {tail:.1e}')

    def _rare_groups(self, counts: dict[tuple[int, int], Counter[tuple[int, float]]],
                     ) -> dict[tuple[int, int | None], tuple[int, float]]:
        """Return how often rare outcomes came, and should have, by distance and action."""
        groups: dict[tuple[int, int | None], tuple[int, float]] = defaultdict(lambda: (0, 0.0))
        for (s, a), seen in counts.items():
            total = sum(seen.values())
            for outcome, p in outcomes(self._world, s, a).items():
                for key in ((outcome[0] - s, a), (outcome[0] - s, None)) if p <= RARE else ():
                    count, mean = groups[key]
                    groups[key] = count + seen[outcome], mean + total * p
        return groups


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


def count_tail(count: int, mean: float) -> float:
    """
    Return a bound of the chance that a sum of independent events is as far from its mean.

    It holds for any probabilities of the events (Chernoff): 2 exp(-(n ln(n / m) - n + m)).
    """
    if mean == 0.0:
        return 1.0 if count == 0 else 0.0
    distance = (count * log(count / mean) if count else 0.0) - count + mean
    return min(1.0, 2.0 * exp(-distance))


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
