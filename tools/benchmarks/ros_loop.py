# SPDX-License-Identifier: Apache-2.0
"""Steps per second of the nodes, and of the nodes with other executors, QoS and settings."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
import time
from typing import Any

from tools.benchmarks.in_process import TimedTraining
from tools.benchmarks.interleave import Bench, ratios, Row
from tools.benchmarks.processes import (
    measure,
    Members,
    one_process,
    RING,
    three_processes,
    write_parameters,
)
from tools.benchmarks.step_times import LoopSpeed

RING_NAME, NODES_NAME, WAITING_NAME = 'empty ring', 'nodes', 'nodes that wait for every advice'
RING_GOAL = 0.9
DEFAULT = 'nodes as they are'
JOURNAL = 'with a state_dir, every step in its journal'
JOURNAL_GOAL = 0.95


def measure_loop(bench: Bench) -> tuple[Iterator[Row], dict[str, Any]]:
    """Rows of the section `loop`, and the speeds that they come from."""
    seconds, folder = 0.3 if bench.quick else 4.0, bench.folder / 'loop'
    parameters = write_parameters(bench.folder)
    waiting = write_parameters(bench.folder / 'waiting', learner={'remembers_advice': False})
    speeds = bench.interleave('loop', {
        RING_NAME: lambda: measure(folder, RING, seconds),
        NODES_NAME: lambda: measure(folder, three_processes(), seconds, parameters),
        WAITING_NAME: lambda: measure(folder, three_processes(), seconds, waiting)})
    return loop_rows(speeds), {name: [speed._asdict() for speed in each]
                               for name, each in speeds.items()}


def loop_rows(speeds: Mapping[str, Sequence[LoopSpeed]]) -> Iterator[Row]:
    """Rows of `speeds[name][round]`."""
    rates = {name: [speed.rate for speed in each] for name, each in speeds.items()}
    yield Row('steps/s of the nodes / rounds/s of the empty ring',
              ratios(rates[NODES_NAME], rates[RING_NAME]), RING_GOAL)
    yield Row('the same, waiting for every advice', ratios(rates[WAITING_NAME], rates[RING_NAME]))
    for name, each in speeds.items():
        yield Row(f'{name}: per second', rates[name])
        yield Row(f'{name}: median of a step, microseconds', [speed.median for speed in each])
        yield Row(f'{name}: 99th percentile, microseconds',
                  [speed.percentile_99 for speed in each])


def measure_choices(bench: Bench) -> tuple[list[Row], dict[str, list[float]]]:
    """Rows of the section `choices`, and the steps per second that they come from."""
    seconds, folder = 0.3 if bench.quick else 4.0, bench.folder / 'choices'
    default = write_parameters(bench.folder)
    state_dir = {'state_dir': str((folder / 'state').resolve())}
    journal = write_parameters(bench.folder / 'journal', state_dir, state_dir, state_dir)

    def rate(members: Members, parameters: Path = default) -> Callable[[], float]:
        return lambda: measure(folder, members, seconds, parameters).rate
    training = TimedTraining('beta_implicit')
    rates = bench.interleave('choices', {
        DEFAULT: rate(three_processes()),
        JOURNAL: rate(three_processes(), journal),
        'on the default executor': rate(three_processes('default_executor')),
        'best effort, not reliable': rate(three_processes('best_effort')),
        'three nodes in one process': rate(one_process()),
        'train, in process': lambda: training.rate(seconds / 10.0, time.perf_counter)})
    return [Row(f'{name} / {DEFAULT}', ratios(each, rates[DEFAULT]),
                JOURNAL_GOAL if name == JOURNAL else None)
            for name, each in rates.items() if name != DEFAULT], rates
