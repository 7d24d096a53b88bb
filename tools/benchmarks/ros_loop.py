# SPDX-License-Identifier: Apache-2.0
"""The loop over topics against an empty ring of three processes, in turn."""

from tools.benchmarks.interleave import ratios, Row
from tools.benchmarks.processes import measure, nodes_file, real, RING

RING_NAME, NODES_NAME, WAITING_NAME = 'empty ring', 'nodes', 'nodes that wait for every advice'
GOAL = 0.85


def measured(bench):
    """Return the rows of the loop, and the raw figures."""
    seconds, folder = 0.3 if bench.quick else 4.0, bench.folder / 'loop'
    usual = nodes_file(bench.folder)
    waits = bench.folder / 'waiting'
    waits.mkdir(exist_ok=True)
    waiting = nodes_file(waits, learner={'remembers_advice': False})
    paces = bench.interleave('loop', {
        RING_NAME: lambda: measure(folder, RING, seconds),
        NODES_NAME: lambda: measure(folder, real(), seconds, usual),
        WAITING_NAME: lambda: measure(folder, real(), seconds, waiting)})
    return rows(paces), {name: [pace._asdict() for pace in each]
                         for name, each in paces.items()}


def rows(paces):
    """Rows of `paces[name][round]`."""
    rates = {name: [pace.rate for pace in each] for name, each in paces.items()}
    ring = rates[RING_NAME]
    yield Row('steps/s of the nodes / rounds/s of the empty ring',
              ratios(rates[NODES_NAME], ring), GOAL)
    yield Row('the same, waiting for every advice', ratios(rates[WAITING_NAME], ring))
    for name in paces:
        yield Row(f'{name}: per second', rates[name])
        yield Row(f'{name}: median of a step, microseconds', [p.median for p in paces[name]])
        yield Row(f'{name}: 99th percentile, microseconds', [p.late for p in paces[name]])
