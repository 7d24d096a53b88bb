# SPDX-License-Identifier: Apache-2.0
"""What is left of a session: `learning.npz`, `summary.json`, and the numbers in it."""

from contextlib import contextmanager
import json
import os
from pathlib import Path
import tempfile

import numpy as np

from comply_ros.learner import metrics
from comply_ros.learner.confidence import confidence_map

FILES = ('summary.json', 'learning.npz', 'learning_curve.png', 'trust_map.png', 'mentor.txt')


class OutputError(ValueError):
    """An output folder that cannot be written; the message names it and the reason."""


def prepare_folder(path):
    """
    Make a folder to write results to, and return its `Path`.

    Raises
    ------
    OutputError: if it cannot be written.

    """
    folder = Path(path).expanduser()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OutputError(f'an output folder must be writable, got {str(path)!r} '
                          f'({error.strerror.lower()})') from None
    for name in FILES:
        if (folder / name).is_dir():
            raise OutputError(f'a result must not have the name of a folder, got {folder / name}')
    return folder


def save_learning(path, method, memory, advice):
    """
    Write the learner's arrays and `confidence[s]` to an .npz file, aside, then rename it.

    advice: `advice[s]` that the confidence is in, -1 where the mentor has said nothing.

    Raises
    ------
    OSError: if it cannot be written; what was there stays.

    """
    path = Path(path).expanduser()
    arrays = memory._asdict()
    with aside(path) as part, part.open('wb') as file:
        np.savez_compressed(
            file, **arrays, confidence=confidence_map(method, memory, advice))


@contextmanager
def aside(path):
    """
    Give a path to write to; when the block has ended well, what is there becomes the file.

    There is never half a file, and after an error what was there stays.
    """
    part = path.with_name(f'{path.name}.{os.getpid()}.part')
    try:
        yield part
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def summarize(options, reference, mentor_return, *, seed, returns, steps, wall_seconds, digest):
    """
    One run as the table that `summary.json` holds; nothing in it is infinite or nan.

    options: the `TrainingOptions` of the session.
    yardstick: the `ReferenceReturns` of its world.
    mentor_return: exact expected return of the mentor's policy, None without a mentor.
    seed: of this run.
    returns: mean return of each iteration; convergence, ratio and regret are of those that learn.
    steps: actions taken.
    wall_seconds: of the learning.
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


def write_json(path, table):
    """Write a table without infinite numbers and nan, whole or not at all; return the path."""
    with aside(path) as part:
        part.write_text(json.dumps(table, indent=2, allow_nan=False) + '\n')
    return path
