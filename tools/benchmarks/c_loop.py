# SPDX-License-Identifier: Apache-2.0
"""A plain C loop of the same SARSA on the same maze, compiled here and now."""

import ctypes
from pathlib import Path
import shutil
import subprocess
import time

import numpy as np

from tools.benchmarks.processes import BenchmarkError

SOURCE = Path(__file__).with_name('sarsa.c')
FLAGS = '-O3', '-fPIC', '-shared'


def compiler():
    """Path of the C compiler, None where there is none."""
    return shutil.which('cc')


class CLoop:
    """
    SARSA in C.

    Parameters
    ----------
    world: the `World`.
    method: a row of SARSA without traces and without a mentor.
    folder: `Path` where the compiled code goes.

    Raises
    ------
    BenchmarkError: for a row that it cannot learn, or code that does not compile.

    """

    def __init__(self, world, method, folder):
        if (method.off_policy, method.trace_decay, method.learning_rate_exponent, method.trust,
                method.confidence_factor) != (False, 0.0, 1.0, 'none', 1.0):
            raise BenchmarkError(f'the C loop learns rows of plain SARSA only, got {method}')
        self._world, self._method = world, method
        self._learn = _compiled(folder)
        self._arrays = [np.ascontiguousarray(array) for array in (
            world.starts, world.successor, world.reward, world.slips, world.terminal)]

    def learn(self, seed):
        """Return steps, seconds and the mean return of each iteration of a whole run."""
        world, method = self._world, self._method
        q = np.where(world.available, method.initial_value, -np.inf)
        visits, returns = np.ones_like(q), np.zeros(method.iterations)
        starts, *arrays = self._arrays
        begin = time.thread_time()
        steps = self._learn(
            ctypes.c_int32(len(starts)), _place(starts), *map(_place, arrays),
            ctypes.c_double(world.grid.intended), ctypes.c_int32(world.grid.step_limit),
            *(ctypes.c_int32(n) for n in (method.iterations, method.episodes,
                                          method.measuring_iterations)),
            *(ctypes.c_double(x) for x in (
                method.discount, method.learning_rate, method.visit_growth, method.temperature,
                method.temperature_factor, method.temperature_floor)),
            ctypes.c_uint64(seed), *map(_place, (q, visits, returns)))
        return steps, time.thread_time() - begin, returns

    def rate(self, seconds):
        """Return the steps per second over whole runs that take at least so long together."""
        steps = spent = seed = 0
        while spent < seconds:
            more, took, _ = self.learn(seed)
            steps, spent, seed = steps + more, spent + took, seed + 1
        return steps / spent


def _place(array):
    return ctypes.c_void_p(array.ctypes.data)


def _compiled(folder):
    """Return the function of `sarsa.c`, compiled into the folder."""
    library = folder / 'sarsa.so'
    done = subprocess.run([compiler(), *FLAGS, str(SOURCE), '-o', str(library), '-lm'],
                          capture_output=True, text=True, check=False)
    if done.returncode:
        raise BenchmarkError(f'cc {" ".join(FLAGS)} must compile {SOURCE.name}: {done.stderr}')
    learn = ctypes.CDLL(str(library)).learn
    learn.restype = ctypes.c_int64
    return learn
