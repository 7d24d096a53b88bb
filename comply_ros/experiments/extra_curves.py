# SPDX-License-Identifier: Apache-2.0
"""Curves over seeds of a greedy policy, of learners that teach each other, of a changed mentor."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.experiments.training_runs import (
    advice_of,
    config_of,
    reference_returns_of,
    Run,
    run_of_seed,
)
from comply_ros.learner.training import Training
from comply_ros.learner.two_learners import TwoLearners
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.planning import greedy

GREEDY_PERIOD = 10  # iterations between two points of a `GreedyCurve`


class GreedyCurve(NamedTuple):
    """Iterations, the learner's mean return in each, the exact return of its greedy policy."""

    numbers: list[int]
    learner: list[float]
    greedy: list[float]


class PairCurves(NamedTuple):
    """`returns[seed, iteration]` of learners that teach each other: seeds 0 and 1, 2 and 3, ..."""

    returns: list[list[float]]


class ExchangeCurves(NamedTuple):
    """
    Of learners whose mentor is replaced by another one half way.

    returns, confidences: `[seed, iteration]`, mean return and mean confidence in the advice.
    exchanged: place of the first iteration with the second mentor.
    """

    returns: NDArray[np.float64]
    confidences: NDArray[np.float64]
    exchanged: int


def greedy_curve(run: Run) -> GreedyCurve:
    """Return the `GreedyCurve` of a learner without a mentor, a point every ten iterations."""
    reference, config = reference_returns_of(run), config_of(run)
    free, points = reference.world.free, []
    training = Training(reference.world, np.full(len(free), NO_ACTION), config, run.seed)
    for number in range(1, config.iterations + 1):
        iteration = training.iterate()
        if number % GREEDY_PERIOD == 0:
            policy = greedy(training.state.q, free)
            points.append((number, iteration.mean_return, reference.return_of(policy)))
    return GreedyCurve(*map(list, zip(*points)))


def pair_curves(run: Run, seeds: int) -> PairCurves:
    """Return the `PairCurves` of learners with so many seeds, from 0 on; the last may be alone."""
    world, config = reference_returns_of(run).world, config_of(run)
    returns = []
    for seed in range(0, seeds, 2):
        pair = TwoLearners(world, config, (seed, seed + 1))
        results = [pair.iterate() for _ in range(config.iterations)]
        returns += [[each.mean_return for each in learner] for learner in zip(*results)]
    return PairCurves(returns[:seeds])


def exchange_curves(run: Run, seeds: int) -> ExchangeCurves:
    """
    Return the `ExchangeCurves` of learners with so many seeds, from 0 on.

    run: with two mentors, such as `noisy:0.3 + random`. The learner has one, who advises by the
        policy of the first until half of the iterations are done, then by that of the second.
    """
    world, config = reference_returns_of(run).world, config_of(run)
    half, returns, confidences = config.iterations // 2, [], []
    for seed in range(seeds):
        first, second = advice_of(run_of_seed(run, seed)).reshape(-1, world.n_states)
        mentor = AdviceBudget(world, first)
        training = Training(world, mentor, config, seed)
        results = [training.iterate() for _ in range(half)]
        mentor.policy[:] = second
        results += [training.iterate() for _ in range(config.iterations - half)]
        returns.append([each.mean_return for each in results])
        confidences.append([each.confidence for each in results])
    return ExchangeCurves(np.array(returns), np.array(confidences), half)


# Of kinds of figures that need more than cells: what computes it from a run and a number of seeds.
EXTRA_CURVES: dict[str, Callable[[Run, int], Any]] = {
    'growth': lambda run, seeds: greedy_curve(run), 'together': pair_curves,
    'exchange': exchange_curves}
