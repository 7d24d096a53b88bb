# SPDX-License-Identifier: Apache-2.0
"""Read access to computed runs: curves, metrics and trust for figures, checks and tables."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.experiments import training_runs
from comply_ros.experiments.extra_curves import ExchangeCurves, GreedyCurve
from comply_ros.experiments.result_cache import CellData, ResultCache
from comply_ros.experiments.training_runs import advice_of, reference_returns_of, Run
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import action_values, greedy, optimal_values

WRONG = 0.15  # a recommendation that costs more than this, one step and a half, is wrong
END_ITERATIONS = 20  # at an end of a curve, over which it is averaged
LAST_ITERATIONS = 50  # over which the end of a single learner is averaged


class EndsTogether(NamedTuple):
    """
    How learners end that teach each other in pairs, and the same ones alone.

    together, alone: mean return of the last 50 iterations, over all seeds.
    better: in how many of the `pairs` both end better than alone.
    """

    together: float
    alone: float
    better: int
    pairs: int


class ExchangeEnds(NamedTuple):
    """
    A mean over all seeds around the exchange of a mentor, each over up to 20 iterations.

    before: the last ones with the first mentor.
    after, end: the first and the last ones with the second.
    """

    before: float
    after: float
    end: float


def exchange_ends(values: NDArray[np.float64], exchanged: int) -> ExchangeEnds:
    """`ExchangeEnds` of `values[seed, iteration]`; exchanged: first one with the second mentor."""
    first, second = values[:, :exchanged], values[:, exchanged:]
    return ExchangeEnds(*(float(np.nanmean(part)) for part in (
        first[:, -END_ITERATIONS:], second[:, :END_ITERATIONS], second[:, -END_ITERATIONS:])))


class Results:
    """Results of the experiments in the worlds and by the metrics of a profile."""

    def __init__(self, cells: ResultCache, profile: str) -> None:
        self.cells, self.profile = cells, profile

    def world(self, map_name: str) -> World:
        """Return the `World` of a map."""
        return reference_returns_of(Run(map_name, self.profile)).world

    def return_at(self, run: Run, level: float) -> float:
        """Return between the random policy's (0) and the optimal one's (1)."""
        reference = reference_returns_of(run)
        return reference.random_return + level * (
            reference.optimal_return - reference.random_return)

    def level_of(self, run: Run, value: float) -> float:
        """Where a return lies, from the random policy (0) to the optimal one (1)."""
        random, optimal = self.return_at(run, 0), self.return_at(run, 1)
        return (value - random) / (optimal - random)

    def cell(self, run: Run) -> CellData:
        """Return the cell of a run."""
        return self.cells.load(run)

    def counted(self, run: Run) -> NDArray[np.float64]:
        """`returns[seed, iteration]` of the iterations that learn."""
        return self.cell(run).returns[:, training_runs.config_of(run).measuring_iterations:]

    def greedy_curve(self, run: Run) -> GreedyCurve:
        """Return the `GreedyCurve` of a run."""
        return GreedyCurve(**self.cells.load_extra('growth', run))

    def counted_together(self, run: Run) -> NDArray[np.float64]:
        """`returns[seed, iteration]` that learn, of learners that teach each other."""
        returns = self.cells.load_extra('together', run)['returns']
        return returns[:, training_runs.config_of(run).measuring_iterations:]

    def ends_together(self, run: Run) -> EndsTogether:
        """Return how learners that teach each other end, and the same ones alone."""
        alone, together = (values[:, -LAST_ITERATIONS:].mean(axis=1)
                           for values in (self.counted(run), self.counted_together(run)))
        pairs = len(alone) // 2
        better = (together > alone)[:2 * pairs].reshape(pairs, 2).all(axis=1)
        return EndsTogether(float(together.mean()), float(alone.mean()), int(better.sum()), pairs)

    def exchange(self, run: Run) -> ExchangeCurves:
        """Return the `ExchangeCurves` of a run, of the iterations that learn; as arrays."""
        curves, skipped = self.cells.load_extra('exchange', run), \
            training_runs.config_of(run).measuring_iterations
        return ExchangeCurves(curves['returns'][:, skipped:], curves['confidences'][:, skipped:],
                              int(curves['exchanged']) - skipped)

    def measured(self, run: Run, name: str) -> list[float | None]:
        """`time_to_convergence`, `reward_ratio` or `regret` of each seed."""
        values = [training_runs.measures(run, each.tolist())[name]
                  for each in self.cell(run).returns]
        if name == 'time_to_convergence':  # never: not before the end
            most = self.counted(run).shape[1]
            return [most if value is None else value for value in values]
        return values

    def mean_of(self, run: Run, name: str) -> float:
        """Mean over the seeds of a measure; nan where no seed has it."""
        values = [each for each in self.measured(run, name) if each is not None]
        return float(np.mean(values)) if values else float('nan')

    def end_of(self, run: Run) -> float:
        """Mean return of the last iterations, over all seeds."""
        return float(self.counted(run)[:, -END_ITERATIONS:].mean())

    def undershoot(self, run: Run) -> float:
        """How far the mean curve falls below what it had reached before; 0 if it only rises."""
        mean = self.counted(run).mean(axis=0)
        smooth = np.convolve(mean, np.ones(END_ITERATIONS) / END_ITERATIONS, 'valid')
        return float((np.maximum.accumulate(smooth) - smooth).max())

    def wrong(self, run: Run) -> NDArray[np.bool_]:
        """`wrong[s]`: where following the mentor once costs more than a step and a half."""
        world, advice = self.world(run.map), advice_of(run)
        q = action_values(world, optimal_values(world))
        advised = q[np.arange(len(q)), np.maximum(advice, 0)]
        return world.free & (advice != NO_ACTION) & (q.max(axis=1) - advised > WRONG)

    def visited_confidence(self, run: Run) -> NDArray[np.float64]:
        """Confidences in the states that the learner visited and that have advice."""
        cell = self.cell(run)
        advised = cell.visited & (advice_of(run) != NO_ACTION) & self.world(run.map).free
        return cell.confidence[advised]

    def greedy_return(self, run: Run) -> float:
        """Exact expected return of the greedy policy that the learner with seed 0 ends with."""
        reference = reference_returns_of(run)
        return reference.return_of(greedy(self.cell(run).q, reference.world.free))
