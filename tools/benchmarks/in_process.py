# SPDX-License-Identifier: Apache-2.0
"""Training in process: steps per second of every method, beside other ways to write it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import signal
import time
from typing import Any

from comply_ros.experiments.available_cores import available_cores
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.presets import METHODS
from comply_ros.learner.training import Training
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World
from tools.benchmarks.c_loop import CLoop, compiler
from tools.benchmarks.interleave import Bench, ratios, Row
from tools.benchmarks.other_libraries import import_error, Mushroom, NumpyLoop

MAP, PROFILE, MENTOR = 'maze', 'published', 'noisy:0.3'
ROWS = METHODS[PROFILE]
C, GYMNASIUM, MUSHROOM = 'C, -O3', 'Gymnasium and numpy', 'MushroomRL'
ONE, ALL = 'one core', 'all cores'
GOAL_ON_TWO_CORES = 1.8
GOALS = {MUSHROOM: 300.0, GYMNASIUM: 100.0, C: 0.6}
INSTALL = 'scripts/python -m pip install --no-deps -r requirements/benchmark.txt'
# The name of a method, or (name of another program, name of a method).
Candidate = str | tuple[str, str]


class TimedTraining:
    """A row of `METHODS` that is trained again and again, as `train` does, and timed."""

    def __init__(self, name: str, world: World | None = None,
                 config: LearnerConfig | None = None, mentor: str = MENTOR) -> None:
        self.world = world or World(read_map(MAP, PROFILE))
        self._config = config or ROWS[name]
        self._advice = mentor_policy(read_mentor_spec(mentor), self.world, 0)
        self._seed = 0
        self._restart()

    def rate(self, seconds: float, clock: Callable[[], float] = time.thread_time,
             whole: bool = False) -> float:
        """
        Return the steps per second over iterations that together take at least so long.

        clock: processor time of this thread, which other work on the machine does not change.
        whole: whether to time whole trainings, from the first iteration to the last.
        """
        steps, spent = 0, 0.0
        while spent < seconds:
            if whole or self._training.iterations_done == self._config.iterations:
                self._restart()
            start = clock()
            for _ in range(self._config.iterations if whole else 1):
                steps += self._training.iterate().steps
            spent += clock() - start
        return steps / spent

    def _restart(self) -> None:
        self._training = Training(self.world, self._advice, self._config, self._seed)
        self._seed += 1


def measure_engine(bench: Bench) -> tuple[list[Row], dict[str, list[float]]]:
    """Rows of the section `engine`, and the steps per second that they come from."""
    seconds = 0.02 if bench.quick else 0.4
    trainings = {name: TimedTraining(name) for name in ROWS}
    candidates: dict[Candidate, Callable[[], float]] = {
        name: lambda each=each: each.rate(seconds, whole=True)
        for name, each in trainings.items()}
    for program, name, make in available_programs(bench):
        loop = make(trainings[name].world, ROWS[name])
        candidates[program, name] = lambda loop=loop: loop.rate(seconds)
    rates = bench.interleave('engine', candidates)
    cores = rates_on_cores(bench, 5 * seconds)
    rows = [*rate_rows(rates), Row(
        f'{ALL} ({available_cores()} processes) / {ONE}', ratios(cores[ALL], cores[ONE]),
        GOAL_ON_TWO_CORES * available_cores() / 2)]
    return rows, {**{key if isinstance(key, str) else ' '.join(key): each
                     for key, each in rates.items()}, **cores}


def available_programs(bench: Bench) -> Iterator[tuple[str, str, Callable[..., Any]]]:
    """Yield (program, method, how it is made) of others that are installed; note the rest."""
    if compiler():
        yield C, 'sarsa', lambda world, config: CLoop(world, config, bench.folder)
    else:
        bench.notes.append(f'{C}: left out, there is no cc: sudo apt install build-essential')
    for program, package, make, names in (
            (GYMNASIUM, 'gymnasium', NumpyLoop, ('sarsa',)),
            (MUSHROOM, 'mushroom_rl.algorithms.value', Mushroom, ('sarsa', 'sarsa_lambda'))):
        reason = import_error(package)
        if reason:
            bench.notes.append(f'{program}: left out ({reason}): {INSTALL}')
            continue
        for name in names:
            yield program, name, make


def rate_rows(rates: Mapping[Candidate, Sequence[float]]) -> Iterator[Row]:
    """Rows of `rates[candidate][round]`: ratios to other programs, then million steps/s."""
    for key, each in rates.items():
        if not isinstance(key, str):
            program, name = key
            yield Row(f'{name} / {program}', ratios(rates[name], each), GOALS[program])
    for key, each in rates.items():
        if isinstance(key, str):
            yield Row(f'{key}, million steps/s', [rate / 1e6 for rate in each])


_training: dict[str, TimedTraining] = {}  # of a worker process


def _init_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is handled by the parent
    _training['worker'] = TimedTraining('beta_implicit')


def _worker_rate(seconds: float) -> float:
    return _training['worker'].rate(seconds, time.perf_counter, whole=True)


def rates_on_cores(bench: Bench, seconds: float) -> dict[str, list[float]]:
    """Measure the steps per second of one process, and of one on each core at the same time."""
    cores = available_cores()
    with ProcessPoolExecutor(cores, get_context('spawn'), _init_worker) as pool:
        list(pool.map(_worker_rate, [0.001] * 4 * cores))  # all workers have started

        def rate_of(processes: int) -> Callable[[], float]:
            return lambda: sum(pool.map(_worker_rate, [seconds] * processes))
        return bench.interleave('all cores', {ONE: rate_of(1), ALL: rate_of(cores)})
