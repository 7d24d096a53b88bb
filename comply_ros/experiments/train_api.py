# SPDX-License-Identifier: Apache-2.0
"""Training from Python: `comply_ros.train` and its result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
import os
from pathlib import Path
import time
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from comply_ros.experiments.stepped_training import training_in
from comply_ros.learner.agent import IterationResult
from comply_ros.learner.learning_result import Learned
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.mentor.best_of_mentors import mentor_returns
from comply_ros.mentor.several_mentors import joined
from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.storage.learning_file import save_learning
from comply_ros.storage.mentor_cache import mentor_policy
from comply_ros.storage.run_files import prepare_folder, summarize
from comply_ros.storage.training_spec import spec_training, TrainingSpec
from comply_ros.terminal.interrupts import StopFlag
from comply_ros.terminal.run_report import write_results
from comply_ros.world.mdp import Source, World
from comply_ros.world.reference_returns import AnyReturns, reference_returns

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OnIteration = Callable[[IterationResult], None]


def train(map: str | os.PathLike[str] | Source = 'maze',  # noqa: A002 - as the option is called
          method: str = 'beta_implicit', mentor: str | Sequence[str] = 'snapshot:0.75', *,
          profile: str = 'published', seed: int = 0, mentor_seed: int = 0, budget: int = 0,
          advising: str = 'early',
          initial_learning: str | os.PathLike[str] | TrainingResult | None = None,
          on_iteration: OnIteration = lambda iteration: None, **settings: Any) -> TrainingResult:
    """
    Learn in this process, and return what came out: the same bits as the three nodes.

    Parameters
    ----------
    map: name of a map of the package (`maze`, `bar_grid`, ...), path of a map file, or an
        environment of Gymnasium, such as `gym:MountainCar-v0?bins=40`; or a map that you made: a
        `Table`, such as `Table.from_transitions(...)`, or a `Grid`.
    method: name of a method, such as `beta_implicit`, `explicit` or `sarsa`.
    mentor: `optimal`, `random`, `adversarial`, `noisy:P`, `snapshot:Q`, `file:PATH`,
        `learned:FILE.npz` or `none`; with `@C` behind it, in a share C of the states only. A list
        for several, such as `['optimal', 'anna=noisy:0.6']`, where the second has a name.
    profile: `published` for the settings of the runs behind the figures of the report, `report`
        for those of its text.
    seed: of the random numbers of world and learner.
    mentor_seed: which one of the mentors of this kind; each of several has the next number.
    budget: recommendations that each mentor may give; 0 for no limit.
    advising: when a mentor with a budget gives one: `early`, `important` or `mistakes`.
    initial_learning: a result, or the path of a `learning.npz`, of the same world. The learner
        begins with its values and beliefs; schedules, counts and random numbers begin anew, so
        this does not continue that training.
    on_iteration: called with the result of each iteration.
    settings: other values for fields of the method, such as `iterations=100`; `learns=False` acts
        by the initial learning and learns nothing.

    Raises
    ------
    ValueError: for a name, a value or a file that cannot be; the message is one sentence.
    EnvironmentFault: if an environment raises an exception while it is used.

    """
    use_kernel_cache()
    initial = initial_learning.learned if isinstance(initial_learning, TrainingResult) \
        else initial_learning
    training = spec_training(
        map, method, joined(mentor), profile=profile, seed=seed, mentor_seed=mentor_seed,
        budget=budget, advising=advising, initial_learning=initial, settings=settings)
    world = World(training.source)
    reference = reference_returns(world)
    advice = mentor_policy(training.spec, world, mentor_seed)
    result = train_seed(training, reference, advice, seed, on_iteration)
    assert result is not None  # it was not stopped
    return result


@dataclass(frozen=True, eq=False, repr=False)
class TrainingResult:
    """
    A training from its first iteration to its last.

    Attributes
    ----------
    training: what it is of.
    reference: the returns of the optimal and of the random policy in its world; None where it has
        no model.
    advice: `advice[s]` of the mentor's policy, -1 for none; of several in rows,
        `advice[m * n_states + s]`.
    seed: of world and learner.
    returns: mean return of each iteration.
    confidences: `confidences[m, iteration]`, mean confidence in the advice of mentor m over the
        decisions that had some; nan where none had.
    steps: actions taken.
    wall_seconds: that it took.
    learned: what the learner has learned.

    """

    training: TrainingSpec
    reference: AnyReturns
    advice: NDArray[Any]
    seed: int
    returns: NDArray[np.float64]
    confidences: NDArray[np.float64]
    steps: int
    wall_seconds: float
    learned: Learned

    def __repr__(self) -> str:
        training = self.training
        return (f'<TrainingResult of {training.method} in {training.map_name}, mentor '
                f'{training.mentor}, seed {self.seed}: {len(self.returns)} iterations, the last '
                f'with a mean return of {self.returns[-1]:.2f}>')

    @property
    def world(self) -> World:
        """The world that it learned in."""
        return self.reference.world

    @property
    def q(self) -> NDArray[np.float64]:
        """Action values `q[s, a]`; -inf where the state does not have the action."""
        return self.learned.state.q

    @property
    def policy(self) -> NDArray[Any]:
        """
        `policy[s]`: what the learner would do if it stopped exploring.

        In a grid 0 left, 1 right, 2 down, 3 up; in any world `world.action_names[a]`. -1 where it
        knows nothing, so that any action is taken.
        """
        return self.learned.policy

    @property
    def confidence(self) -> NDArray[np.float64]:
        """
        Confidence `p[s]` in the mentor's advice in state s, in [0, 1].

        Of several mentors in rows, `p[m * n_states + s]`; `learned.mentors` has their names.
        """
        return self.learned.confidence

    @cached_property
    def policy_return(self) -> float | None:
        """Exact expected return of an episode by `policy`; None in a world without a model."""
        return self.reference.return_of(self.policy)

    @property
    def regret(self) -> float | None:
        """
        Sum over the iterations that learn of the optimal return minus the mean return.

        None in a world without a model.
        """
        return self.summary['regret']

    @cached_property
    def digest(self) -> str:
        """SHA-256 (hex) of the learner's arrays: equal for equal bits."""
        return self.learned.state.digest()

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The table that `summary.json` holds."""
        has_mentor = self.training.spec.kind != 'none'
        returns = mentor_returns(self.training.spec, self.reference, self.advice) \
            if has_mentor else {}
        return summarize(self.training, self.reference, returns, **self.outcome())

    def outcome(self) -> dict[str, Any]:
        """Return the numbers of this seed, as `summarize` takes them."""
        return {'seed': self.seed, 'returns': self.returns.tolist(),
                'confidences': dict(zip(self.learned.mentors, self.confidences.tolist())),
                'steps': self.steps, 'wall_seconds': self.wall_seconds, 'digest': self.digest,
                'policy_return': self.policy_return}

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """Return the learning curve as a figure of matplotlib; write it to a PNG if asked to."""
        from comply_ros.plots.training_plots import learning_curve_figure
        return _written(learning_curve_figure(self.returns[None], self.summary), path)

    def plot_trust(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """Return the map of the confidence as a figure; write it to a PNG if asked to."""
        from comply_ros.plots.training_plots import trust_map_figure
        return _written(trust_map_figure(self.world, self.advice, self.confidence,
                                         self.learned.state.departures > 1.0, self.summary,
                                         self.learned.mentors), path)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """
        Write the files of the command `train` to a folder, which is made, and return it.

        Raises
        ------
        OutputError: if the folder cannot be written. OSError: if a file cannot.

        """
        place = prepare_folder(os.fspath(folder))
        save_learning(place / 'learning.npz', self.learned)
        write_results(self.training, place, self.reference, self.advice, [self.outcome()])
        return place


def _written(figure: Figure, path: str | os.PathLike[str] | None) -> Figure:
    from comply_ros.plots.grid_plot import write_picture
    if path is not None:
        write_picture(figure, Path(path).expanduser())
    return figure


def train_seed(training: TrainingSpec, reference: AnyReturns, advice: NDArray[Any],
               seed: int, on_iteration: OnIteration, stop: StopFlag | None = None,
               ) -> TrainingResult | None:
    """
    Return the result of one seed; None if `stop` is set after an iteration.

    reference: of the world of the training. advice: `advice[s]` of the mentor, or of several in
        rows.
    """
    world, config = reference.world, training.config
    rows = advice.reshape(-1, world.n_states)
    mentors = {name: AdviceBudget(world, row, training.budget, training.advising)
               for name, row in zip(training.spec.by_name(), rows)}
    with training_in(world, training.map_name, mentors, config, seed, training.initial) as process:
        start, returns, confidences, steps = time.perf_counter(), [], [], 0
        for _ in range(config.iterations):
            iteration = process.iterate()
            returns.append(iteration.mean_return)
            confidences.append(iteration.confidences or (iteration.confidence,))
            steps += iteration.steps
            on_iteration(iteration)
            if stop is not None and stop.is_set():
                return None
        seconds = time.perf_counter() - start
        return TrainingResult(training, reference, advice, seed, np.array(returns),
                              np.array(confidences).T, steps, seconds, process.learned())
