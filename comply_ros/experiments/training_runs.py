# SPDX-License-Identifier: Apache-2.0
"""One learning in process from its first iteration to its last, asked for in plain values."""

from dataclasses import replace
from functools import lru_cache
from threading import Lock
from typing import NamedTuple

import numpy as np

from comply_ros.learner import metrics
from comply_ros.learner.confidence import confidence_map
from comply_ros.learner.learner_config import ConfigError, LearnerConfig, with_text
from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget, validate_advice_budget
from comply_ros.mentor.policy_text import parse_policy, PolicyError
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import greedy, ReferenceReturns

PUBLISHED_MAZES = ('maze', 'maze_as_run')
EVERY = 10  # iterations between two looks at a learner's greedy policy
COUNTED = 399  # iterations over which regret is summed: as many as the published runs had

_making = Lock()  # a world or a mentor is made once, not once a thread


class Run(NamedTuple):
    """
    What to learn: the same values as the options of `train`.

    Attributes
    ----------
    settings: `((field, value), ...)` of the method that differ from its row.

    """

    map: str = 'maze'
    profile: str = 'published'
    method: str = 'beta_implicit'
    settings: tuple = ()
    mentor: str = 'none'
    mentor_seed: int = 0
    budget: int = 0
    advising: str = 'early'
    seed: int = 0


class Learned(NamedTuple):
    """
    What came of a run.

    Attributes
    ----------
    returns: mean return of each iteration.
    changes: largest change of an action value in each iteration, [] if it was not watched.
    confidence: `p[s]` at the end. visited: `visited[s]`, bool. q: `q[s, a]`.
    steps: actions taken. digest: of the learner's arrays.

    """

    returns: list
    changes: list
    confidence: list
    visited: np.ndarray
    q: np.ndarray
    steps: int
    digest: str


def row_of(run):
    """
    Return the `LearnerConfig` of a run, with its settings.

    Raises
    ------
    MethodError: for an unknown method, profile or field, or a value that the field cannot have.

    """
    values = {name: getattr(with_text(LearnerConfig(), name, str(value)), name)
              for name, value in run.settings}
    row = replace(find_method(run.method, run.profile), **values)
    if row.iterations == 0:
        raise ConfigError('a run needs an end: iterations must be at least 1, got 0')
    return row


def check_run(run):
    """
    Return if a run can be; its mentor is not generated for that.

    Raises
    ------
    ValueError: naming the thing, the rule and the value.

    """
    row_of(run)
    world = yardstick_of(run).world
    spec = read_mentor_spec(run.mentor)
    if spec.kind == 'file':
        try:
            parse_policy(spec.value, world)
        except PolicyError as error:
            raise PolicyError(f'{run.mentor.removeprefix("file:")}: {error}') from None
    validate_advice_budget(run.budget, run.advising)


@lru_cache(maxsize=64)
def _yardstick(name, profile):
    return ReferenceReturns(World(read_map(name, profile)))


def yardstick_of(run):
    """`ReferenceReturns` of a run's world, made once in a process."""
    with _making:
        return _yardstick(run.map, run.profile)


@lru_cache(maxsize=64)
def _advice(name, profile, mentor, seed):
    spec = read_mentor_spec(mentor)
    return mentor_policy(spec, _yardstick(name, profile).world, seed)


def advice_of(run):
    """`advice[s]` of a run's mentor, made once in a process."""
    with _making:
        return _advice(run.map, run.profile, run.mentor, run.mentor_seed)


def learn(run, stop=None, watches_values=False):
    """
    Return the `Learned` of a run; None if the `Stop` stop was set on the way.

    watches_values: whether to note how much the action values change in each iteration.
    """
    world, row, advice = yardstick_of(run).world, row_of(run), advice_of(run)
    training = Training(world, AdviceBudget(world, advice, run.budget, run.advising), row, run.seed)
    returns, changes, steps = [], [], 0
    for _ in range(row.iterations):
        before = training.state.q.copy() if watches_values else None
        iteration = training.iterate()
        returns.append(iteration.mean_return)
        steps += iteration.steps
        if watches_values:
            there = world.available
            changes.append(float(np.abs(training.state.q[there] - before[there]).max()))
        if stop is not None and stop.is_set():
            return None
    memory = training.state
    return Learned(returns, changes, confidence_map(row, memory, advice).tolist(),
                   memory.departures > 1.0, memory.q, steps, memory.digest())


class Growth(NamedTuple):
    """Iterations, the learner's mean return in each, its greedy policy's exact return."""

    numbers: list
    learner: list
    greedy: list


def growth(run):
    """Return the `Growth` of a learner without a mentor, every tenth iteration."""
    reference, row = yardstick_of(run), row_of(run)
    world, looks = reference.world, []
    training = Training(world, np.full(len(world.free), NO_ACTION), row, run.seed)
    for number in range(1, row.iterations + 1):
        iteration = training.iterate()
        if number % EVERY == 0:
            policy = greedy(training.state.q, world.free)
            looks.append((number, iteration.mean_return, reference.return_of(policy)))
    return Growth(*map(list, zip(*looks)))


def reference_return(run):
    """
    Return what measures compare with: the exact return of the optimal policy.

    In the mazes of the profile `published`, what those runs measured, so that numbers compare.
    """
    if run.profile == 'published' and run.map in PUBLISHED_MAZES:
        return metrics.PUBLISHED_OPTIMAL
    return yardstick_of(run).optimal_return


def measures(run, returns):
    """
    Time to convergence, reward ratio and regret of a run, as a table; see `core.metrics`.

    returns: mean return of each iteration; those that only measure are left out. Regret is that of
    the first 399.
    """
    counted = returns[row_of(run).measuring_iterations:]
    optimal = reference_return(run)
    level = metrics.threshold(run.profile, optimal)
    convergence = metrics.time_to_convergence(run.profile, counted, level)
    return {'time_to_convergence': convergence,
            'reward_ratio': metrics.reward_ratio(counted, convergence, optimal),
            'regret': metrics.regret(counted[:COUNTED], optimal)}


def mentor_return(run):
    """Exact expected return of a run's mentor, None without one."""
    advice = advice_of(run)
    return yardstick_of(run).return_of(advice) if (advice != NO_ACTION).any() else None
