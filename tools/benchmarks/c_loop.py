# SPDX-License-Identifier: Apache-2.0
"""The same SARSA as a plain loop in C, which is compiled when it is used."""

import ctypes
from pathlib import Path
import shutil
import subprocess
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.world.mdp import World
from tools.benchmarks.interleave import BenchmarkError

SOURCE = Path(__file__).with_name('sarsa.c')
FLAGS = '-O3', '-fPIC', '-shared'


def compiler() -> str | None:
    """Path of the C compiler; None if there is none."""
    return shutil.which('cc')


class CLoop:
    """
    SARSA in C.

    Parameters
    ----------
    config: of SARSA without traces and without a mentor.
    folder: for the compiled code.

    Raises
    ------
    BenchmarkError: for another config, or if the code does not compile.

    """

    def __init__(self, world: World, config: LearnerConfig, folder: Path) -> None:
        if (config.off_policy, config.trace_decay, config.learning_rate_exponent, config.trust,
                config.confidence_factor) != (False, 0.0, 1.0, 'none', 1.0):
            raise BenchmarkError(f'the C loop can only learn plain SARSA, got {config}')
        self._world, self._config = world, config
        self._learn = _compiled(folder)
        self._arrays = [np.ascontiguousarray(array) for array in (
            world.starts, world.successor, world.reward, world.slips, world.terminal)]

    def learn(self, seed: int) -> tuple[int, float, NDArray[np.float64]]:
        """Return steps, seconds and the mean return of each iteration of a training."""
        world, config = self._world, self._config
        q = np.where(world.available, config.initial_value, -np.inf)
        visits, returns = np.ones_like(q), np.zeros(config.iterations)
        starts, *arrays = self._arrays
        start = time.thread_time()
        steps = self._learn(
            ctypes.c_int32(len(starts)), _pointer(starts), *map(_pointer, arrays),
            ctypes.c_double(world.grid.intended), ctypes.c_int32(world.grid.step_limit),
            *(ctypes.c_int32(n) for n in (config.iterations, config.episodes,
                                          config.measuring_iterations)),
            *(ctypes.c_double(x) for x in (
                config.discount, config.learning_rate, config.visit_growth, config.temperature,
                config.temperature_factor, config.temperature_floor)),
            ctypes.c_uint64(seed), *map(_pointer, (q, visits, returns)))
        return steps, time.thread_time() - start, returns

    def rate(self, seconds: float) -> float:
        """Return the steps per second over trainings that together take at least so long."""
        steps, spent, seed = 0, 0.0, 0
        while spent < seconds:
            more, took, _ = self.learn(seed)
            steps, spent, seed = steps + more, spent + took, seed + 1
        return steps / spent


def _pointer(array: NDArray[Any]) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def _compiled(folder: Path) -> Any:
    """Compile `sarsa.c` into the folder; return its function `learn`."""
    library = folder / 'sarsa.so'
    done = subprocess.run([str(compiler()), *FLAGS, str(SOURCE), '-o', str(library), '-lm'],
                          capture_output=True, text=True, check=False)
    if done.returncode:
        raise BenchmarkError(f'cc {" ".join(FLAGS)} must compile {SOURCE.name}: {done.stderr}')
    learn = ctypes.CDLL(str(library)).learn
    learn.restype = ctypes.c_int64
    return learn
