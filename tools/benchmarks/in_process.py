# SPDX-License-Identifier: Apache-2.0
"""The engine: steps per second of every method in process, against other ways to write it."""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import os
import signal
import time

from comply_ros.learner.presets import METHODS
from comply_ros.learner.training import Training
from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World
from tools.benchmarks.c_loop import CLoop, compiler
from tools.benchmarks.interleave import ratios, Row
from tools.benchmarks.other_libraries import missing, Mushroom, NumpyLoop

MAP, PROFILE, MENTOR = 'maze', 'published', 'noisy:0.3'
ROWS = METHODS[PROFILE]
C, GYMNASIUM, MUSHROOM = 'C, -O3', 'Gymnasium and numpy', 'MushroomRL'
ONE, ALL = 'one core', 'all cores'
ALL_GOAL_ON_TWO = 1.8
GOALS = {MUSHROOM: 300.0, GYMNASIUM: 100.0, C: 0.6}
INSTALL = 'scripts/python -m pip install --no-deps -r requirements/benchmark.txt'


class Lesson:
    """Whole runs of a row of `METHODS` in process, as `train` does them."""

    def __init__(self, name, world=None, method=None, mentor=MENTOR):
        self.world = world or World(read_map(MAP, PROFILE))
        self._method = method or ROWS[name]
        self._advice = mentor_policy(read_mentor_spec(mentor), self.world, 0)
        self._training, self._seed = None, 0
        self._begin()

    def rate(self, seconds, clock=time.thread_time):
        """
        Return the steps per second over whole iterations that take at least so long.

        clock: of this thread's processor time, which other work on the machine does not change.
        """
        steps, spent = 0, 0.0
        while spent < seconds:
            if self._training.iterations_done == self._method.iterations:
                self._begin()
            begin = clock()
            steps += self._training.iterate().steps
            spent += clock() - begin
        return steps / spent

    def _begin(self):
        self._training = Training(self.world, self._advice, self._method, self._seed)
        self._seed += 1


class WholeRuns(Lesson):
    """The same, always from the first iteration to the last."""

    def rate(self, seconds, clock=time.thread_time):
        """Return the steps per second over whole runs that take at least so long together."""
        steps, spent = 0, 0.0
        while spent < seconds:
            self._begin()
            begin = clock()
            steps += sum(self._training.iterate().steps for _ in range(self._method.iterations))
            spent += clock() - begin
        return steps / spent


def measured(bench):
    """Return the rows of the engine, and the raw figures: steps per second."""
    seconds = 0.02 if bench.quick else 0.4
    lessons = {name: WholeRuns(name) for name in ROWS}
    others = {(peer, name): made(lessons[name].world, ROWS[name])
              for peer, name, made in peers(bench)}
    contestants = {**lessons, **others}
    rates = bench.interleave('engine', {
        key: lambda each=each: each.rate(seconds) for key, each in contestants.items()})
    cores = on_all_cores(bench, 5 * seconds)
    rows = [*rows_of(rates), Row(f'{ALL} ({os.cpu_count()} processes) / {ONE}', ratios(
        cores[ALL], cores[ONE]), ALL_GOAL_ON_TWO * os.cpu_count() / 2)]
    return rows, {**{' '.join(key) if isinstance(key, tuple) else key: each
                     for key, each in rates.items()}, **cores}


def peers(bench):
    """Yield who is there to be compared with: peer, row and how it is made; note who is not."""
    if compiler():
        yield C, 'sarsa', lambda world, row: CLoop(world, row, bench.folder)
    else:
        bench.notes.append(f'{C}: left out, there is no cc: sudo apt install build-essential')
    for peer, package, make, names in (
            (GYMNASIUM, 'gymnasium', NumpyLoop, ('sarsa',)),
            (MUSHROOM, 'mushroom_rl.algorithms.value', Mushroom, ('sarsa', 'sarsa_lambda'))):
        reason = missing(package)
        if reason:
            bench.notes.append(f'{peer}: left out ({reason}): {INSTALL}')
            continue
        for name in names:
            yield peer, name, make


def rows_of(rates):
    """Rows of `rates[name]` and `rates[peer, name]`: against the peers, then million steps/s."""
    for key in rates:
        if isinstance(key, tuple):
            peer, name = key
            yield Row(f'{name} / {peer}', ratios(rates[name], rates[key]), GOALS[peer])
    for key, each in rates.items():
        if isinstance(key, str):
            yield Row(f'{key}, million steps/s', [rate / 1e6 for rate in each])


_here = {}  # of a worker process: its lesson


def _prepare():
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one that waits for it
    use_kernel_cache()
    _here['lesson'] = WholeRuns('beta_implicit')


def _rate(seconds):
    return _here['lesson'].rate(seconds, time.perf_counter)


def on_all_cores(bench, seconds):
    """Return the figures of one process, and of one on each core at the same time."""
    cores = os.cpu_count()
    with ProcessPoolExecutor(cores, get_context('spawn'), _prepare) as pool:
        list(pool.map(_rate, [0.001] * 4 * cores))  # all have begun

        def with_processes(count):
            return lambda: sum(pool.map(_rate, [seconds] * count))
        return bench.interleave('all cores', {ONE: with_processes(1), ALL: with_processes(cores)})
