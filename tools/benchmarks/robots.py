# SPDX-License-Identifier: Apache-2.0
"""Load of several robots: with a mentor process each, and with one for all of them."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
import os
from pathlib import Path
import time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tools.benchmarks.interleave import Bench, Row
from tools.benchmarks.processes import (
    namespace_of,
    running,
    three_processes,
    two_processes,
    wait_until_warm,
    write_parameters,
)
from tools.benchmarks.step_times import TIMES_FILE
from tools.soak import process_memory

ROBOTS, QUICK = (1, 2, 4, 8), (1, 2)
USER, SYSTEM = 11, 12  # fields of /proc/PID/stat behind the name: ticks of processor time


class Load(NamedTuple):
    """
    The load of several robots together.

    Attributes
    ----------
    rate: steps per second of all robots.
    processors: processor time of all their nodes, over the time that passed.
    memory: of all their processes, in MB.

    """

    rate: float
    processors: float
    memory: float


class Robots(NamedTuple):
    """So many robots, with one mentor for all of them or one each."""

    count: int
    one_mentor: bool = False

    def __str__(self) -> str:
        name = 'one robot' if self.count == 1 else f'{self.count} robots'
        return f'{name}, one mentor' if self.one_mentor else name


def measure_robots(bench: Bench) -> tuple[list[Row], dict[str, Any]]:
    """Rows of the section `robots`, and the loads that they come from."""
    seconds, folder = 0.3 if bench.quick else 4.0, bench.folder / 'robots'
    loads = bench.interleave('robots', {
        robots: lambda robots=robots: measure_load(folder, robots, seconds)
        for robots in candidates(QUICK if bench.quick else ROBOTS)})
    return list(load_rows(loads)), {str(robots): [load._asdict() for load in each]
                                    for robots, each in loads.items()}


def candidates(counts: Sequence[int]) -> list[Robots]:
    """Return robots with a mentor each, and where there are several, with one for all."""
    return [Robots(count, one) for count in counts for one in ((False, True) if count > 1
                                                               else (False,))]


def load_rows(loads: Mapping[Robots, Sequence[Load]]) -> Iterator[Row]:
    """Rows of `loads[robots][round]`."""
    for name, each in loads.items():
        yield Row(f'{name}: steps per second in all', [load.rate for load in each])
        yield Row(f'{name}: processors in use', [load.processors for load in each])
        yield Row(f'{name}: processor time of a step, microseconds',
                  [1e6 * load.processors / load.rate for load in each])
        yield Row(f'{name}: memory, MB', [load.memory for load in each])


def measure_load(folder: Path, robots: Robots, seconds: float) -> Load:
    """Return the load of robots that all run, measured for some seconds after the warm-up."""
    places = [folder / f'robot_{number}' for number in range(robots.count)]
    others = [namespace_of(place.name) for place in places[1:]] if robots.one_mentor else []
    with ExitStack() as stack:
        loops = [stack.enter_context(running(
            place, two_processes() if seed and others else three_processes(),
            parameters_of(folder, seed, others if seed == 0 else []), f'/{place.name}'))
            for seed, place in enumerate(places)]
        for place, processes in zip(places, loops):
            wait_until_warm(place, processes)
        pids = [process.pid for processes in loops for process in processes]
        start, before = time.monotonic_ns(), processor_seconds(pids)
        time.sleep(seconds)  # the robots run meanwhile
        end, used = time.monotonic_ns(), processor_seconds(pids) - before
        memory = sum(map(process_memory, pids))
    elapsed = (end - start) / 1e9
    steps = sum(count_steps(np.fromfile(place / TIMES_FILE, dtype=np.int64), start, end)
                for place in places)
    return Load(steps / elapsed, used / elapsed, memory)


def parameters_of(folder: Path, seed: int, others: Sequence[str]) -> Path:
    """Write the parameter file of a robot, whose mentor teaches others too; return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    return write_parameters(folder / f'parameters_{seed}', {'seed': seed},
                            {'robots': [*others]} if others else None, {'seed': seed})


def count_steps(times: NDArray[np.int64], start: int, end: int) -> int:
    """Return the steps of what `StepTimes.write` wrote from a time to another, in nanoseconds."""
    return int(((times >= start) & (times < end)).sum())


def processor_seconds(pids: Sequence[int]) -> float:
    """Return the processor time of all threads of processes, in seconds."""
    ticks = 0
    for pid in pids:
        fields = Path(f'/proc/{pid}/stat').read_text().rpartition(') ')[2].split()
        ticks += int(fields[USER]) + int(fields[SYSTEM])
    return ticks / os.sysconf('SC_CLK_TCK')
