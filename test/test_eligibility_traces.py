# SPDX-License-Identifier: Apache-2.0
"""Eligibility traces: left, spread, dropped, ended."""

import numpy as np
import pytest
from tiny_worlds import Bench, room

from comply_ros.learner.eligibility_traces import end_traces, mark_trace, propagate_along_traces


def traced(**settings):
    """Return a bench with traces of lambda 0.5, and its two arrays of them."""
    bench = Bench(room(), trace_decay=0.5, **settings)
    return bench, bench.memory.traces, bench.memory.trail


@pytest.mark.parametrize('replacing, trace', [(False, 1.5), (True, 1.0)])
def test_a_visit_accumulates_or_replaces(as_run, replacing, trace):
    bench, traces, trail = traced(replacing_traces=replacing)
    as_run(mark_trace)(4, 1, bench.numbers, traces, trail)
    traces[4, 1] = 0.5
    as_run(mark_trace)(4, 1, bench.numbers, traces, trail)
    assert traces[4, 1] == trace
    assert trail[:3].tolist() == [1, 17, 0]


def test_a_change_is_shared_by_the_traces_which_fade(as_run):
    # changes: 2 * 1.0 and 2 * 0.5; then 1.0 and 0.5 fade to 0.4 and 0.2, below the floor 0.3
    bench, traces, trail = traced()
    traces[4, 1], traces[3, 2] = 1.0, 0.5
    trail[:3] = 2, 14, 17
    as_run(propagate_along_traces)(2.0, 0.4, 0.3, bench.memory.q, traces, trail)
    assert (bench.memory.q[4, 1], bench.memory.q[3, 2]) == (2.0, 1.0)
    assert (traces[4, 1], traces[3, 2]) == (0.4, 0.0)
    assert trail[:2].tolist() == [1, 17]


def test_without_decay_nothing_is_left(as_run):
    bench, traces, trail = traced()
    as_run(mark_trace)(4, 1, bench.numbers, traces, trail)
    as_run(propagate_along_traces)(1.0, 0.0, 0.0, bench.memory.q, traces, trail)
    assert not traces.any() and trail[0] == 0


def test_the_end_of_traces(as_run):
    bench, traces, trail = traced()
    for s in (4, 3, 5):
        as_run(mark_trace)(s, 2, bench.numbers, traces, trail)
    as_run(end_traces)(traces, trail)
    assert not traces.any() and trail[0] == 0


def test_sparse_and_full_traces_are_the_same(as_run):
    """The pseudo-code of the report goes over all states; a trail gives the same values."""
    bench, traces, trail = traced()
    rng, full, q = np.random.default_rng(0), np.zeros((9, 4)), bench.memory.q.copy()
    for _ in range(200):
        s, a, change = rng.integers(9), rng.integers(4), rng.normal()
        as_run(mark_trace)(s, a, bench.numbers, traces, trail)
        as_run(propagate_along_traces)(change, 0.5, 0.005, bench.memory.q, traces, trail)
        full[s, a] += 1.0
        q += change * full
        full *= 0.5
        full[full < 0.005] = 0.0
        assert np.array_equal(traces, full)
    assert np.array_equal(bench.memory.q[q > -np.inf], q[q > -np.inf])
