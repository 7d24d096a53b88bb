# SPDX-License-Identifier: Apache-2.0
"""One training in process from its first iteration to its last, described by plain values."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, wraps
from threading import RLock
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from comply_ros.experiments.stepped_training import training_in
from comply_ros.learner import return_metrics
from comply_ros.learner.confidence import confidence_map
from comply_ros.learner.learner_config import ConfigError, LearnerConfig, with_text
from comply_ros.learner.presets import find_method
from comply_ros.mentor.advice_budget import AdviceBudget, validate_advice_budget
from comply_ros.mentor.best_of_mentors import mentor_returns
from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.storage.map_files import read_world
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec, validate_files
from comply_ros.terminal.interrupts import StopFlag
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.reference_returns import AnyReturns, reference_returns

MENTOR_OF_SEED = -1  # mentor seed of a cell in which each seed of the learner has its own mentor
REGRET_ITERATIONS = 399  # over which regret is summed: as many as the published runs had

T = TypeVar('T')
_lock = RLock()


class Run(NamedTuple):
    """What to learn, as in the options of `train`; settings: `((field, value), ...)`."""

    map: str = 'maze'
    profile: str = 'published'
    method: str = 'beta_implicit'
    settings: tuple[tuple[str, object], ...] = ()
    mentor: str = 'none'
    mentor_seed: int = 0
    budget: int = 0
    advising: str = 'early'
    seed: int = 0

    def cell_name(self) -> str:
        """Return the name of the run's cell: everything but the seed."""
        parts = [self.map, self.profile, self.method,
                 *(f'{name}={value}' for name, value in self.settings)]
        if self.mentor != 'none':
            parts.append(f'mentor {self.mentor}')
        if self.mentor_seed:
            parts.append(f'mentor seed {self.mentor_seed}')
        if self.budget:
            parts.append(f'budget {self.budget} {self.advising}')
        return ', '.join(parts)


class RunResult(NamedTuple):
    """
    What a run returned and learned.

    returns, changes: of each iteration, the mean return and the largest change of an action value
        ([] if it was not watched). steps: actions taken. digest: of the learner's arrays.
    confidence, visited, q: `p[s]`, `visited[s]` and `q[s, a]` at the end.
    """

    returns: list[float]
    changes: list[float]
    confidence: list[float]
    visited: NDArray[np.bool_]
    q: NDArray[np.float64]
    steps: int
    digest: str


def run_of_seed(run: Run, seed: int) -> Run:
    """Return the run of one seed of a cell, with its mentor."""
    is_own = run.mentor_seed == MENTOR_OF_SEED
    return run._replace(seed=seed, mentor_seed=seed if is_own else run.mentor_seed)


def setting_value(name: str, value: object) -> object:
    """Return the value of a field in its type; raise ConfigError if the field cannot have it."""
    return getattr(with_text(LearnerConfig(), name, str(value)), name)


def config_of(run: Run) -> LearnerConfig:
    """Return the `LearnerConfig` of a run; raise ConfigError if there is none."""
    settings = {name: setting_value(name, value) for name, value in run.settings}
    config = replace(find_method(run.method, run.profile), **settings)
    if config.iterations == 0:
        raise ConfigError('a run needs an end: iterations must be at least 1, got 0')
    return config


def validate_run(run: Run) -> None:
    """Return if a run is valid, without generating its mentor; raise a ValueError otherwise."""
    config_of(run)
    world = reference_returns_of(run).world
    try:
        validate_files(read_mentor_spec(run.mentor), world)
    except PolicyError as error:
        raise PolicyError(f'{run.mentor.removeprefix("file:")}: {error}') from None
    validate_advice_budget(run.budget, run.advising)


def _cached_by(*names: str) -> Callable[[Callable[[Run], T]], Callable[[Run], T]]:
    """Cache a function of a `Run` by these fields; one thread at a time computes."""
    def decorate(function: Callable[[Run], T]) -> Callable[[Run], T]:
        cached = lru_cache(maxsize=64)(function)

        @wraps(function)
        def compute_once(run: Run) -> T:
            with _lock:
                return cached(Run(**{name: getattr(run, name) for name in names}))
        return compute_once
    return decorate


@_cached_by('map', 'profile')
def reference_returns_of(run: Run) -> AnyReturns:
    """Return what is known of the returns in a run's world."""
    return reference_returns(World(read_world(run.map, run.profile)))


@_cached_by('map', 'profile', 'mentor', 'mentor_seed')
def advice_of(run: Run) -> NDArray[Any]:
    """Return `advice[s]` of a run's mentor, or of several in rows."""
    world = reference_returns_of(run).world
    return mentor_policy(read_mentor_spec(run.mentor), world, run.mentor_seed)


@_cached_by('map', 'profile', 'mentor', 'mentor_seed')
def mentor_return(run: Run) -> float | None:
    """
    Exact expected return of a run's mentor, of several that of the best one.

    None without one, or without a model.
    """
    advice, reference = advice_of(run), reference_returns_of(run)
    returns = mentor_returns(read_mentor_spec(run.mentor), reference, advice)
    known = [each for each in returns.values() if each is not None]
    return max(known) if known and (advice != NO_ACTION).any() else None


def learn(run: Run, stop: StopFlag | None = None,
          watches_values: bool = False) -> RunResult | None:
    """
    Return the `RunResult` of a run; None if `stop` was set on the way.

    watches_values: whether to record how much the action values change in each iteration.
    """
    world, config, advice = reference_returns_of(run).world, config_of(run), advice_of(run)
    names = read_mentor_spec(run.mentor).by_name()
    mentors = {name: AdviceBudget(world, row, run.budget, run.advising)
               for name, row in zip(names, advice.reshape(-1, world.n_states))}
    returns, changes, steps = [], [], 0
    with training_in(world, run.map, mentors, config, run.seed) as training:
        for _ in range(config.iterations):
            before = training.state.q[world.available] if watches_values else None
            iteration = training.iterate()
            returns.append(iteration.mean_return)
            steps += iteration.steps
            if before is not None:
                changes.append(float(np.abs(training.state.q[world.available] - before).max()))
            if stop is not None and stop.is_set():
                return None
        state = training.state
    return RunResult(returns, changes, confidence_map(config, state, advice).tolist(),
                     state.departures > 1.0, state.q, steps, state.digest())


def measures(run: Run, returns: list[float]) -> dict[str, float | None]:
    """
    Return time to convergence, reward ratio and regret of a run by name, as `return_metrics`.

    None for each in a world without a model.

    In the mazes of the profile `published` they compare with the optimal return that those runs
    measured, elsewhere with the exact one.

    returns: mean return of each iteration. Those that only measure are left out; regret is that
        of the first 399 others.
    """
    counted = returns[config_of(run).measuring_iterations:]
    published = run.profile == 'published' and run.map in ('maze', 'maze_as_run')
    optimal = return_metrics.PUBLISHED_OPTIMAL if published else \
        reference_returns_of(run).optimal_return
    if optimal is None:
        return dict.fromkeys(('time_to_convergence', 'reward_ratio', 'regret'))
    level = return_metrics.threshold(run.profile, optimal)
    convergence = return_metrics.time_to_convergence(run.profile, counted, level)
    return {'time_to_convergence': convergence,
            'reward_ratio': return_metrics.reward_ratio(counted, convergence, optimal),
            'regret': return_metrics.regret(counted[:REGRET_ITERATIONS], optimal)}
