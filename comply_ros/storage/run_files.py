# SPDX-License-Identifier: Apache-2.0
"""The files of a training: `learning.npz`, `summary.json`, and the numbers in it."""

import json
from pathlib import Path
import tempfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.learner import metrics
from comply_ros.learner.confidence import confidence_map
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.learner_state import LearnerState
from comply_ros.storage.file_system import atomic_write, path_errors, PathError
from comply_ros.world.planning import ReferenceReturns

FILES = ('summary.json', 'learning.npz', 'learning_curve.png', 'trust_map.png', 'mentor.txt')


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


def save_learning(path: str | Path, method: LearnerConfig, memory: LearnerState,
                  advice: NDArray[np.int8]) -> None:
    """
    Write the learner's arrays and `confidence[s]` to an .npz file, as a whole.

    advice: `advice[s]` that the confidence is in, -1 where the mentor gave none.

    Raises
    ------
    OSError: if it cannot be written; the file is as before.

    """
    path = Path(path).expanduser()
    arrays = memory._asdict()
    with atomic_write(path) as part, part.open('wb') as file:
        np.savez_compressed(
            file, **arrays, confidence=confidence_map(method, memory, advice))


def summarize(options: Any, reference: ReferenceReturns, mentor_return: float | None, *,
              seed: int, returns: list[float], steps: int, wall_seconds: float,
              digest: str) -> dict[str, Any]:
    """
    One training as the table that `summary.json` holds; nothing in it is infinite or nan.

    options: the `TrainingOptions` of the command.
    mentor_return: exact expected return of the mentor's policy, None without a mentor.
    returns: mean return of each iteration; convergence, ratio and regret are of those that learn.
    digest: of the learner's arrays.
    """
    counted = returns[options.config.measuring_iterations:]
    threshold = metrics.threshold(options.profile, reference.optimal_return)
    convergence = metrics.time_to_convergence(options.profile, counted, threshold)
    optimality = None if mentor_return is None else reference.optimality(mentor_return)
    return {
        'map': options.map_name, 'profile': options.profile, 'method': options.method,
        'mentor': options.mentor, 'mentor_seed': options.mentor_seed,
        'budget': options.budget, 'advising': options.advising,
        'mentor_return': mentor_return, 'mentor_optimality': optimality,
        'optimal_return': reference.optimal_return, 'random_return': reference.random_return,
        'seed': seed, 'iterations': len(returns),
        'measuring_iterations': len(returns) - len(counted), 'episodes': options.config.episodes,
        'settings': options.settings, 'steps': steps, 'wall_seconds': wall_seconds,
        'steps_per_second': steps / wall_seconds, 'return_per_iteration': list(returns),
        'convergence_threshold': threshold, 'time_to_convergence': convergence,
        'reward_ratio': metrics.reward_ratio(counted, convergence, reference.optimal_return),
        'regret': metrics.regret(counted, reference.optimal_return),
        'final_return': returns[-1], 'digest': digest}


def write_json(path: Path, table: dict[str, Any]) -> Path:
    """Write a table without infinite numbers and nan, as a whole; return the path."""
    with atomic_write(path) as part:
        part.write_text(json.dumps(table, indent=2, allow_nan=False) + '\n')
    return path
