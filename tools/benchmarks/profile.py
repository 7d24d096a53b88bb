# SPDX-License-Identifier: Apache-2.0
"""Where a step over topics goes: processor time of every thread, and of the parts of callbacks."""

import json
from pathlib import Path
import time

import numpy as np

from tools.benchmarks.interleave import Row
from tools.benchmarks.processes import NODES, nodes_file, real, RING, running, warm
from tools.benchmarks.step_times import pace, STAMPS


def measured(bench):
    """Return the rows of the profile, and the raw figures: microseconds, of a step or a call."""
    seconds, folder = 0.5 if bench.quick else 4.0, bench.folder / 'where'
    parameters = nodes_file(bench.folder)
    looks = bench.interleave('where', {
        'ring': lambda: look(folder, RING, seconds),
        'nodes': lambda: look(folder, real(), seconds, parameters),
        'parts': lambda: look(folder, real('profiled'), seconds, parameters)})
    rows = [Row(f'{loop}: {label}', [each[label] for each in looks[loop]])
            for loop in looks for label in looks[loop][0]]
    return rows, looks


def look(folder, members, seconds, parameters=None):
    """Return what a step takes, in microseconds, by the name of what takes it."""
    with running(folder, members, parameters) as processes:
        warm(folder, processes)
        before = [threads(process.pid) for process in processes]
        begin = time.monotonic_ns()
        time.sleep(seconds)  # what is measured is how much happens meanwhile
        after, end = [threads(process.pid) for process in processes], time.monotonic_ns()
    moments = np.fromfile(folder / STAMPS, dtype=np.int64)
    turns = int(((np.abs(moments) >= begin) & (np.abs(moments) < end)).sum())
    found = {'wall clock': (end - begin) / 1e3 / turns, 'median of a step': pace(moments).median}
    for number, (_, name, *_) in enumerate(members):
        found.update(processor_time(name, before[number], after[number], turns))
    for name in NODES:
        found.update(parts(folder / f'{name}.json', name))
    return found


def threads(pid):
    """Nanoseconds on a processor, nanoseconds of waiting for one, and turns on it, by thread."""
    found = {}
    for task in Path(f'/proc/{pid}/task').iterdir():
        found[int(task.name)] = [int(number) for number in
                                 (task / 'schedstat').read_text().split()]
    return found


def processor_time(name, before, after, turns):
    """Table of what a process took from the processors: its first thread, and all others."""
    spent = {tid: [now - then for now, then in zip(numbers, before.get(tid, (0, 0, 0)))]
             for tid, numbers in after.items()}
    first = spent.pop(min(spent))
    others = [sum(each) for each in zip(*spent.values())] or [0, 0, 0]
    return {f'{name}: thread of Python': first[0] / 1e3 / turns,
            f'{name}: threads of DDS': others[0] / 1e3 / turns,
            f'{name}: waiting for a processor': (first[1] + others[1]) / 1e3 / turns,
            f'{name}: times on a processor': (first[2] + others[2]) / turns}


def parts(path, name):
    """Table of the parts of a node's callbacks, in microseconds a call; {} if not looked at."""
    if not path.exists():
        return {}
    return {f'{name}, median of a call: {label}': nanoseconds / 1e3
            for label, nanoseconds in json.loads(path.read_text()).items()}
