# SPDX-License-Identifier: Apache-2.0
"""What figures, verdicts and tables ask of the results: from cells on disk and known worlds."""

import numpy as np

from comply_ros.experiments import training_runs
from comply_ros.experiments.training_runs import Run
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.planning import action_values, greedy, optimal_values

WRONG = 0.15  # a recommendation that costs more than this, one step and a half, is wrong
LAST = 20  # iterations at an end of a curve that are averaged


class Results:
    """
    Results of the experiments.

    Parameters
    ----------
    cells: the `Cells` on disk.
    profile: whose worlds and metrics.

    """

    def __init__(self, cells, profile):
        self.cells, self.profile = cells, profile

    def world(self, grid):
        """Return the `World` of a map."""
        return training_runs.yardstick_of(Run(grid, self.profile)).world

    def optimal_return(self, run):
        """Exact expected return of the optimal policy."""
        return training_runs.yardstick_of(run).optimal_return

    def return_at(self, run, level):
        """Return between the random policy's (0) and the optimal one's (1)."""
        reference = training_runs.yardstick_of(run)
        return reference.random_return + level * (
            reference.optimal_return - reference.random_return)

    def cell(self, run):
        """Return the `CellData` of a run."""
        return self.cells.load(run)

    def counted(self, run):
        """`returns[seed, iteration]` of the iterations that learn."""
        return self.cell(run).returns[:, training_runs.row_of(run).measuring_iterations:]

    def measured(self, run, name):
        """List over the seeds of `time_to_convergence`, `reward_ratio` or `regret`."""
        values = [training_runs.measures(run, each.tolist())[name] for each in self.cell(run).returns]
        if name == 'time_to_convergence':  # never: not before the end
            most = self.counted(run).shape[1]
            return [most if value is None else value for value in values]
        return values

    def mean_of(self, run, name):
        """Mean over the seeds of a measure; nan where no seed has it."""
        values = [each for each in self.measured(run, name) if each is not None]
        return float(np.mean(values)) if values else float('nan')

    def end_of(self, run):
        """Mean return of the last iterations, over all seeds."""
        return float(self.counted(run)[:, -LAST:].mean())

    def share_of_optimal(self, run):
        """Where the end of a curve lies, from the random policy (0) to the optimal one (1)."""
        random, optimal = (self.return_at(run, level) for level in (0, 1))
        return (self.end_of(run) - random) / (optimal - random)

    def undershoot(self, run):
        """How far the mean curve falls below what it had reached before; 0 if it only rises."""
        mean = self.counted(run).mean(axis=0)
        smooth = np.convolve(mean, np.ones(LAST) / LAST, 'valid')
        return float((np.maximum.accumulate(smooth) - smooth).max())

    def advice(self, run):
        """`advice[s]` of the run's mentor."""
        return training_runs.advice_of(run)

    def mentor_return(self, run):
        """Exact expected return of the run's mentor."""
        return training_runs.mentor_return(run)

    def wrong(self, run):
        """`wrong[s]`, bool: where following the mentor once costs more than a step and a half."""
        world, advice = self.world(run.map), self.advice(run)
        q = action_values(world, optimal_values(world))
        advised = q[np.arange(len(q)), np.maximum(advice, 0)]
        return world.free & (advice != NO_ACTION) & (q.max(axis=1) - advised > WRONG)

    def trusted(self, run):
        """List of the confidences in the states that the learner visited and that have advice."""
        cell = self.cell(run)
        there = cell.visited & (self.advice(run) != NO_ACTION) & self.world(run.map).free
        return cell.confidence[there]

    def greedy_return(self, run):
        """Exact expected return of the greedy policy that the learner with seed 0 ends with."""
        reference = training_runs.yardstick_of(run)
        return reference.return_of(greedy(self.cell(run).q, reference.world.free))

    def growth(self, run):
        """Return the `Growth` of a learner with seed 0."""
        return self.cells.load_growth(run)
