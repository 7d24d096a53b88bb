# SPDX-License-Identifier: Apache-2.0
"""Eligibility traces: marked, faded, dropped, cleared."""

import numpy as np
import pytest
from tiny_tables import hall, machine
from tiny_worlds import Bench, FOUR, room

from comply_ros.learner.eligibility_traces import (
    clear_traces,
    mark_trace,
    propagate_along_traces,
)
from comply_ros.world.mdp import World


def traced(**settings):
    """Return a bench with lambda 0.5, its traces and its trail."""
    bench = Bench(room(), trace_decay=0.5, **settings)
    return bench, bench.state.traces, bench.state.trail


@pytest.mark.parametrize('replacing, trace', [(False, 1.5), (True, 1.0)])
def test_a_visit_accumulates_or_replaces(as_run, replacing, trace):
    bench, traces, trail = traced(replacing_traces=replacing)
    as_run(mark_trace)(4, 1, bench.kernel_config, traces, trail)
    traces[4, 1] = 0.5
    as_run(mark_trace)(4, 1, bench.kernel_config, traces, trail)
    assert traces[4, 1] == trace
    assert trail[:3].tolist() == [1, 17, 0]


def test_a_change_is_multiplied_by_the_traces_which_fade(as_run):
    # changes: 2 * 1.0 and 2 * 0.5; then 1.0 and 0.5 fade to 0.4 and 0.2, below the floor 0.3
    bench, traces, trail = traced()
    traces[4, 1], traces[3, 2] = 1.0, 0.5
    trail[:3] = 2, 14, 17
    as_run(propagate_along_traces)(2.0, 0.4, 0.3, bench.state.q, traces, trail, FOUR)
    assert (bench.state.q[4, 1], bench.state.q[3, 2]) == (2.0, 1.0)
    assert (traces[4, 1], traces[3, 2]) == (0.4, 0.0)
    assert trail[:2].tolist() == [1, 17]


def test_with_a_decay_of_0_no_trace_is_left(as_run):
    bench, traces, trail = traced()
    as_run(mark_trace)(4, 1, bench.kernel_config, traces, trail)
    as_run(propagate_along_traces)(1.0, 0.0, 0.0, bench.state.q, traces, trail, FOUR)
    assert not traces.any() and trail[0] == 0


def test_cleared_traces_are_gone(as_run):
    bench, traces, trail = traced()
    for s in (4, 3, 5):
        as_run(mark_trace)(s, 2, bench.kernel_config, traces, trail)
    as_run(clear_traces)(traces, trail, FOUR)
    assert not traces.any() and trail[0] == 0


def test_sparse_and_full_traces_are_the_same(as_run):
    """The pseudo-code of the report goes over all states; a trail gives the same values."""
    bench, traces, trail = traced()
    rng, full, q = np.random.default_rng(0), np.zeros((9, 4)), bench.state.q.copy()
    for _ in range(200):
        s, a, change = rng.integers(9), rng.integers(4), rng.normal()
        as_run(mark_trace)(s, a, bench.kernel_config, traces, trail)
        as_run(propagate_along_traces)(change, 0.5, 0.005, bench.state.q, traces, trail, FOUR)
        full[s, a] += 1.0
        q += change * full
        full *= 0.5
        full[full < 0.005] = 0.0
        assert np.array_equal(traces, full)
    assert np.array_equal(bench.state.q[q > -np.inf], q[q > -np.inf])


@pytest.mark.parametrize('world, states', [(World(machine()), 2), (World(hall(6, 20)), 6)])
def test_traces_find_their_state_and_action_with_any_number_of_actions(as_run, world, states):
    bench, s, a = Bench(world, trace_decay=0.5), states - 1, world.n_actions - 1
    actions, traces, trail = bench.kernel_config.actions, bench.state.traces, bench.state.trail
    as_run(mark_trace)(s, a, bench.kernel_config, traces, trail)
    as_run(mark_trace)(0, 1, bench.kernel_config, traces, trail)
    assert trail[:3].tolist() == [2, world.n_actions * s + a, 1]
    q = np.zeros((world.n_states, world.n_actions))
    as_run(propagate_along_traces)(2.0, 0.5, 0.1, q, traces, trail, actions)
    assert (q[s, a], q[0, 1], q.sum()) == (2.0, 2.0, 4.0)
    as_run(clear_traces)(traces, trail, actions)
    assert not traces.any() and trail[0] == 0
