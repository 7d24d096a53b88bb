# SPDX-License-Identifier: Apache-2.0
"""Where a step over topics spends its time: processor time by thread, and parts of callbacks."""

from collections.abc import Sequence
import json
from pathlib import Path
import time

import numpy as np

from tools.benchmarks.instrumented_nodes import REACTION, TIMED
from tools.benchmarks.interleave import Bench, Row
from tools.benchmarks.processes import (
    Members,
    NODES,
    RING,
    running,
    three_processes,
    wait_until_warm,
    write_parameters,
)
from tools.benchmarks.step_times import loop_speed, TIMES_FILE

# Of a thread, by its id: nanoseconds on a processor and waiting for one, and times on it.
Threads = dict[int, list[int]]


def measure_parts(bench: Bench) -> tuple[list[Row], dict[str, list[dict[str, float]]]]:
    """Rows of the section `where`, and what they come from: microseconds of a step or a call."""
    seconds, folder = 0.5 if bench.quick else 4.0, bench.folder / 'where'
    parameters = write_parameters(bench.folder)
    profiles = bench.interleave('where', {
        'ring': lambda: profile(folder, RING, seconds),
        'nodes': lambda: profile(folder, three_processes(), seconds, parameters),
        'parts': lambda: profile(folder, three_processes(TIMED), seconds, parameters),
        'reaction': lambda: profile(folder, three_processes(REACTION), seconds, parameters)})
    rows = [Row(f'{loop}: {label}', [each[label] for each in rounds])
            for loop, rounds in profiles.items() for label in rounds[0]]
    return rows, profiles


def profile(folder: Path, members: Members, seconds: float,
            parameters: Path | None = None) -> dict[str, float]:
    """Return microseconds of a step, by what they were spent on."""
    with running(folder, members, parameters) as processes:
        wait_until_warm(folder, processes)
        before = [threads(process.pid) for process in processes]
        start = time.monotonic_ns()
        time.sleep(seconds)  # the loop runs meanwhile
        after, end = [threads(process.pid) for process in processes], time.monotonic_ns()
    times = np.fromfile(folder / TIMES_FILE, dtype=np.int64)
    steps = int(((np.abs(times) >= start) & (np.abs(times) < end)).sum())
    found = {'wall clock': (end - start) / 1e3 / steps,
             'median of a step': loop_speed(times).median}
    for number, (_, name, *_) in enumerate(members):
        found.update(processor_time(name, before[number], after[number], steps))
    for name in NODES:
        found.update(callback_parts(folder / f'{name}.json', name))
    return found


def threads(pid: int) -> Threads:
    """Read the kernel's counters of the threads of a process."""
    return {int(task.name): [int(number) for number in (task / 'schedstat').read_text().split()]
            for task in Path(f'/proc/{pid}/task').iterdir()}


def processor_time(name: str, before: Threads, after: Threads, steps: int) -> dict[str, float]:
    """Processor time of a process per step, in microseconds: its first thread, and the others."""
    spent = {tid: _difference(counters, before.get(tid, (0, 0, 0)))
             for tid, counters in after.items()}
    first = spent.pop(min(spent))
    others = [sum(each) for each in zip(*spent.values())] or [0, 0, 0]
    return {f'{name}: thread of Python': first[0] / 1e3 / steps,
            f'{name}: threads of DDS': others[0] / 1e3 / steps,
            f'{name}: waiting for a processor': (first[1] + others[1]) / 1e3 / steps,
            f'{name}: times on a processor': (first[2] + others[2]) / steps}


def _difference(after: Sequence[int], before: Sequence[int]) -> list[int]:
    return [now - then for now, then in zip(after, before)]


def callback_parts(path: Path, name: str) -> dict[str, float]:
    """Parts of a node's callbacks, in microseconds of a call; {} if they were not timed."""
    if not path.exists():
        return {}
    return {f'{name}, median of a call: {label}': nanoseconds / 1e3
            for label, nanoseconds in json.loads(path.read_text()).items()}
