# SPDX-License-Identifier: Apache-2.0
"""Numbers of the suite: regrets, and of each rule whether it holds. Computed, never typed in."""

from collections.abc import Mapping, Sequence
from typing import Any

from comply_ros.experiments.computed_results import Results
from comply_ros.experiments.seed_statistics import interval
from comply_ros.experiments.suite_runs import ALONE, BASELINES, MENTORS, SuiteWorld
from comply_ros.experiments.training_runs import reference_returns_of, Run
from comply_ros.numerics.summation import mean_in_order

MENTOR_FACTOR = 1.25  # with a mentor, times the regret without one, it is this at most
LAST_ITERATIONS = 50  # of a curve where no regret is known
Numbers = dict[str, Any]


def world_numbers(results: Results, world: SuiteWorld) -> Numbers:
    """
    Return regrets and rules in a world.

    `holds[rule]`: whether it holds, for each mentor, and for `alone`: the method without one
    against the best baseline. `clear[rule]`: whether it is broken and the seeds leave no doubt.
    """
    runs = world.runs(results.profile)
    regrets = {name: _regrets(results, run) for name, run in runs.items()}
    means = {name: mean_in_order(values) for name, values in regrets.items()}
    best = min(BASELINES, key=lambda name: means[name])
    most = {mentor: _scaled(regrets[ALONE]) for mentor in MENTORS}
    pairs = {**{mentor: (regrets[mentor], most[mentor]) for mentor in MENTORS},
             'alone': (regrets[ALONE], regrets[best])}
    return {
        'map': world.map, 'held_out': world.held_out,
        'states': reference_returns_of(runs[ALONE]).world.n_states, 'best': best,
        'regret': {name: _measure(values) for name, values in regrets.items()},
        'holds': {name: holds(*pair) for name, pair in pairs.items()},
        'clear': {name: not holds(*pair) and is_clear(*pair) for name, pair in pairs.items()}}


def holds(values: list[float], most: list[float]) -> bool:
    """Tell whether the mean of values is at most that of others, in the whole numbers shown."""
    return round(mean_in_order(values)) <= round(mean_in_order(most))


def is_clear(values: list[float], most: list[float]) -> bool:
    """Tell whether the 95 % interval of the differences, seed by seed, is above 0."""
    differences = [value - bound for value, bound in zip(values, most, strict=True)]
    return len(differences) > 1 and interval(differences)[1] > 0.0


def count_rule(worlds: Sequence[Numbers], rule: str) -> tuple[int, int]:
    """Return in how many worlds a rule holds, and how many there are; `all`: every mentor's."""
    kept = [all(world['holds'][mentor] for mentor in MENTORS) if rule == 'all'
            else world['holds'][rule] for world in worlds]
    return sum(kept), len(kept)


def ablation_numbers(results: Results, runs: Mapping[tuple[float, str, str], Run]) -> Numbers:
    """Return the regrets by intended probability, the part that is missing, and the mentor."""
    numbers: Numbers = {}
    for (intended, part, mentor), run in runs.items():
        row = numbers.setdefault(str(intended), {}).setdefault(part, {})
        row[mentor] = _measure(_regrets(results, run))
    return numbers


def last_returns(results: Results, runs: Mapping[str, Run]) -> Numbers:
    """Return the mean return of the last iterations of each run, with its interval."""
    return {name: _measure(results.counted(run)[:, -LAST_ITERATIONS:].mean(axis=1).tolist())
            for name, run in runs.items()}


def _regrets(results: Results, run: Run) -> list[float]:
    return [value for value in results.measured(run, 'regret') if value is not None]


def _scaled(regrets: list[float]) -> list[float]:
    return [MENTOR_FACTOR * value for value in regrets]


def _measure(values: list[float]) -> dict[str, float]:
    mean, low, high = interval(values)
    return {'mean': mean, 'low': low, 'high': high}
