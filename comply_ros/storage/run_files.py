# SPDX-License-Identifier: Apache-2.0
"""The folder of a training's results, `summary.json`, and the numbers in it."""

from collections.abc import Mapping, Sequence
import json
from math import isnan
from pathlib import Path
import tempfile
from typing import Any

from comply_ros.learner import return_metrics
from comply_ros.storage.file_system import atomic_write, path_errors, PathError
from comply_ros.storage.training_spec import TrainingSpec
from comply_ros.world.reference_returns import AnyReturns

COMPARED = 'convergence_threshold', 'time_to_convergence', 'reward_ratio', 'regret'
UNKNOWN = ('mentor_return', 'mentor_optimality', 'optimal_return', 'random_return', *COMPARED,
           'policy_return')  # what needs a model of the world
FILES = ('summary.json', 'learning.npz', 'learning_curve.png', 'confidence.png', 'trust_map.png',
         'mentor.txt')


class OutputError(ValueError):
    """An output folder that cannot be written; the message names it and the reason."""


def prepare_folder(path: str | Path) -> Path:
    """
    Make a folder for results, and return its `Path`.

    Raises
    ------
    OutputError: if it cannot be written.

    """
    try:
        with path_errors():
            folder = Path(path).expanduser()
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
    except PathError as error:
        raise OutputError(f'an output folder must be writable, got {str(path)!r} '
                          f'({error})') from None
    for name in FILES:
        if (folder / name).is_dir():
            raise OutputError(f'a result must not have the name of a folder, got {folder / name}')
    return folder


def summarize(training: TrainingSpec, reference: AnyReturns,
              mentor_returns: Mapping[str, float | None], *,
              seed: int, returns: list[float], confidences: Mapping[str, Sequence[float]],
              steps: int, wall_seconds: float, digest: str | None, policy_return: float | None,
              other_mentors: int = 0, best_of_mentors_return: float | None = None,
              ) -> dict[str, Any]:
    """
    One training as the table that `summary.json` holds; nothing in it is infinite or nan.

    reference: returns of the world. Where they are not known, neither is what is compared with
        them: it is None, and `unknown` has the names.
    mentor_returns: exact expected return of each mentor's policy by its name; empty without one.
    confidences: mean confidence in each mentor in each iteration; nan without its advice.
    returns: mean return of each iteration; convergence, ratio and regret are of those that learn.
    digest: of the learner's arrays; None for a learner that does not save them.
    policy_return: exact expected return of the policy that was learned, None without it.
    other_mentors: how many mentors, besides those of the training, have advised the learner too.
    best_of_mentors_return: of several mentors, that of `best_of_mentors`.
    """
    counted = returns[training.config.measuring_iterations:]
    known = [each for each in mentor_returns.values() if each is not None]
    mentor_return = max(known, default=None)
    optimality = None if mentor_return is None else reference.optimality(mentor_return)
    compared = compared_with(reference.optimal_return, training.profile, counted)
    return {
        'map': training.map_name, 'step_limit': training.source.step_limit,
        'profile': training.profile, 'method': training.method,
        'mentor': training.mentor, 'mentor_seed': training.mentor_seed,
        'budget': training.budget, 'advising': training.advising,
        'mentor_return': mentor_return, 'mentor_optimality': optimality,
        'optimal_return': reference.optimal_return, 'random_return': reference.random_return,
        'seed': seed, 'iterations': len(returns),
        'measuring_iterations': len(returns) - len(counted), 'episodes': training.config.episodes,
        'initial_learning': training.initial_learning, 'settings': training.settings,
        'steps': steps, 'wall_seconds': wall_seconds,
        'steps_per_second': steps / wall_seconds, 'return_per_iteration': list(returns),
        'confidence_per_iteration': known_confidences(confidences),
        **compared,
        'final_return': returns[-1], 'policy_return': policy_return, 'digest': digest,
        'other_mentors': other_mentors,
        'mentor_returns': dict(mentor_returns) if len(mentor_returns) > 1 else {},
        'best_of_mentors_return': best_of_mentors_return,
        'unknown': list(UNKNOWN) if reference.optimal_return is None else []}


def known_confidences(confidences: Mapping[str, Sequence[float]],
                      ) -> dict[str, list[float | None]]:
    """Return confidences by mentor with None in place of nan; empty where all of them are nan."""
    table = {name: [None if isnan(value) else value for value in values]
             for name, values in confidences.items()}
    return table if any(value is not None for row in table.values() for value in row) else {}


def compared_with(optimal_return: float | None, profile: str,
                  counted: Sequence[float]) -> dict[str, float | None]:
    """
    Return the figures of a training that compare it with the optimal policy, by name.

    optimal_return: None where it is not known, and then neither are the figures.
    counted: mean return of each iteration that counts.
    """
    if optimal_return is None:
        return dict.fromkeys(COMPARED)
    threshold = return_metrics.threshold(profile, optimal_return)
    convergence = return_metrics.time_to_convergence(profile, counted, threshold)
    return dict(zip(COMPARED, (
        threshold, convergence, return_metrics.reward_ratio(counted, convergence, optimal_return),
        return_metrics.regret(counted, optimal_return)), strict=True))


def write_json(path: Path, table: dict[str, Any]) -> Path:
    """Write a table without infinite numbers and nan, as a whole; return the path."""
    with atomic_write(path) as part:
        part.write_text(json.dumps(table, indent=2, allow_nan=False) + '\n')
    return path
