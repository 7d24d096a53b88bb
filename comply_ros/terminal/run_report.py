# SPDX-License-Identifier: Apache-2.0
"""The results of a training: summary, pictures and table, the same for `train` and `lesson`."""

from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
import gc
from importlib import import_module
from multiprocessing import get_context
import os
from pathlib import Path
import signal
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.mentor.best_of_mentors import best_of_mentors, mentor_returns
from comply_ros.mentor.policy_text import format_policy
from comply_ros.storage.run_files import summarize, write_json
from comply_ros.storage.training_spec import TrainingSpec
from comply_ros.terminal.console import show_paths, show_table
from comply_ros.terminal.interrupts import end_with_parent
from comply_ros.world.reference_returns import AnyReturns

PLOTS = 'comply_ros.plots.training_plots'  # loaded when it is used: it loads matplotlib
Plot = Callable[..., Future]  # called with the name of a function of PLOTS, and its arguments
PER_SEED = ('seed', 'steps', 'wall_seconds', 'steps_per_second', 'return_per_iteration',
            'confidence_per_iteration', 'time_to_convergence', 'reward_ratio', 'regret',
            'final_return', 'policy_return', 'digest')


def plot_here(name: str, *arguments: Any) -> Future:
    """Plot in this process, which may have threads; return a future that is done."""
    done: Future = Future()
    done.set_result(_plot(name, *arguments))
    return done


@contextmanager
def plot_process() -> Generator[Plot]:
    """
    Give a `Plot` that works in another process, which loads matplotlib while this one learns.

    Enter it before there are threads: the process is a fork of this one. Its garbage collector
    leaves alone what this one has made: nodes of ROS cannot be deleted there.
    """
    with ProcessPoolExecutor(1, get_context('fork'), _init_worker, (os.getpid(),)) as pool:
        gc.freeze()
        try:
            pool.submit(_load_plots)  # which forks
        finally:
            gc.unfreeze()
        yield lambda name, *arguments: pool.submit(_plot, name, *arguments)


def _init_worker(parent: int) -> None:
    """Leave Ctrl-C to the parent, and end when it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with_parent(parent)


def _load_plots() -> None:
    import_module(PLOTS)


def _plot(name: str, *arguments: Any) -> None:
    getattr(import_module(PLOTS), name)(*arguments)


def report_training(training: TrainingSpec, folder: Path, reference: AnyReturns,
                    advice: NDArray[Any] | None, outcomes: Sequence[dict[str, Any]],
                    plot: Plot = plot_here) -> None:
    """Write and show the results of a training; arguments as `write_results`."""
    summary, files = write_numbers(training, folder, reference, advice, outcomes)
    first = summary if len(outcomes) == 1 else {
        key: value[0] if key in PER_SEED else value for key, value in summary.items()}
    show_table(first, [each['seed'] for each in outcomes])
    show_paths(files)
    show_paths(draw_pictures(training, folder, reference, advice, outcomes, first, plot))


def write_results(training: TrainingSpec, folder: Path, reference: AnyReturns,
                  advice: NDArray[Any] | None, outcomes: Sequence[dict[str, Any]]) -> None:
    """
    Write the results of a training: what was learned first, then what is drawn of it.

    reference: of the world of the training.
    advice: `advice[s]` of the mentor, or of several in rows; None if it is not known.
    outcomes: one table for each seed, with the arguments of `summarize`; `learning.npz` of the
        first is already in the folder, if that has a digest.
    """
    summary, _ = write_numbers(training, folder, reference, advice, outcomes)
    for _ in draw_pictures(training, folder, reference, advice, outcomes, summary, plot_here):
        pass


def write_numbers(training: TrainingSpec, folder: Path, reference: AnyReturns,
                  advice: NDArray[Any] | None, outcomes: Sequence[dict[str, Any]],
                  ) -> tuple[dict[str, Any], list[Path]]:
    """Write all but the pictures; return the summary and the paths of the files."""
    if training.spec.kind == 'none':
        advice = None
    returns = {} if advice is None else mentor_returns(training.spec, reference, advice)
    best = None if len(returns) < 2 or reference.optimal_return is None else \
        reference.return_of(best_of_mentors(reference.world, advice))
    summaries = [summarize(training, reference, returns, best_of_mentors_return=best, **each)
                 for each in outcomes]
    first = summaries[0]
    summary = first if len(summaries) == 1 else {
        key: [each[key] for each in summaries] if key in PER_SEED else value
        for key, value in first.items()}
    files = [write_json(folder / 'summary.json', summary)]
    if first['digest'] is not None:
        files.append(folder / 'learning.npz')
    if advice is not None:
        for name, row in zip(returns, advice.reshape(len(returns), -1)):
            files.append(folder / (f'mentor_{name}.txt' if name else 'mentor.txt'))
            files[-1].write_text(format_policy(row, reference.world))
    return summary, files


def draw_pictures(training: TrainingSpec, folder: Path, reference: AnyReturns,
                  advice: NDArray[Any] | None, outcomes: Sequence[dict[str, Any]],
                  summary: dict[str, Any], plot: Plot) -> Generator[Path]:
    """Draw the pictures of a training; yield the path of each when it is written."""
    curves = np.array([each['returns'] for each in outcomes])
    curve, trust = folder / 'learning_curve.png', folder / 'trust_map.png'
    plots = {curve: plot('draw_learning_curve', curve, curves, summary)}
    confidences = mean_confidences([each['confidences'] for each in outcomes])
    if confidences:
        picture = folder / 'confidence.png'
        plots[picture] = plot('draw_confidence_curves', picture, confidences, summary)
    if training.spec.kind != 'none' and advice is not None and training.config.needs_mentor() \
            and outcomes[0]['digest'] is not None:
        with np.load(folder / 'learning.npz') as learned:
            plots[trust] = plot('draw_trust_map', trust, reference.world, advice,
                                learned['confidence'], learned['departures'] > 1, summary,
                                tuple(training.spec.by_name()))
    for path, done in plots.items():
        done.result()
        yield path


def mean_confidences(outcomes: Sequence[Mapping[str, Sequence[float]]],
                     ) -> dict[str, tuple[Sequence[int], Sequence[float]]]:
    """Return iterations and mean confidence over seeds of each mentor; empty where all are nan."""
    rows = np.array([list(each.values()) for each in outcomes])  # [seed, mentor, iteration]
    known = np.isfinite(rows)
    if not known.any():
        return {}
    count = known.sum(axis=0)
    means = np.where(known, rows, 0.0).sum(axis=0) / np.where(count, count, np.nan)
    iterations = range(1, rows.shape[-1] + 1)
    return {name: (iterations, mean) for name, mean in zip(outcomes[0], means)}
