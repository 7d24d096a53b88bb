# SPDX-License-Identifier: Apache-2.0
"""The view of a run: what it stores, and what it leaves out."""

import numpy as np
import pytest
from tiny_worlds import grid

from comply_ros.dashboard.run_view import MAX_RUNS, RunView
from comply_ros.protocol.messages import describe, Policy, Progress, StateReward, Trust

GRID = grid('..G', '...')


@pytest.fixture
def view():
    view = RunView()
    view.on_world(describe(GRID, 'small', run=7, began=1.0))
    return view


def progress(run, iteration, mean_return=0.0):
    """Return a `Progress` of a training without end."""
    return Progress(run, iteration, 0, 15, 100 * iteration, mean_return, 0.5, 1.0, False)


def test_there_is_nothing_to_show_before_a_world():
    view = RunView()
    view.on_state_map('trust', Trust(7, 3, 2, [0.5] * 6))
    assert view.snapshot.world is None and view.snapshot.reports.trust is None


def test_a_state_that_arrived_before_its_world_is_shown_with_it():
    view = RunView()
    view.observe(StateReward(7, 1, 0, GRID.starts[0], 0.0, False, False))
    view.on_world(describe(GRID, 'small', run=7))
    assert view.snapshot.reports.observation.state == GRID.starts[0]


def test_reports_that_arrived_before_their_world_are_stored():
    view = RunView()
    view.on_state_map('trust', Trust(7, 3, 2, [0.5] * 6))
    view.on_progress(progress(7, 1))
    view.on_world(describe(GRID, 'small', run=7))
    assert view.snapshot.reports.trust.tolist() == [0.5] * 6
    assert view.snapshot.reports.curve.iterations == (1,)


def test_reports_of_another_run_are_not_shown(view):
    view.on_progress(progress(8, 1))
    view.on_state_map('mentor_policy', Policy(8, 3, 2, [0] * 6))
    assert view.snapshot.reports.progress is None and view.snapshot.reports.mentor_policy is None


def test_maps_that_do_not_fit_the_world_are_left_out(view):
    view.on_state_map('mentor_policy', Policy(7, 3, 2, [1, 1, 3, 1, 1, -1]))
    assert view.snapshot.reports.mentor_policy.dtype == np.int8
    for action in ([0] * 6, [0] * 5, [9] * 6):  # the first would leave the grid
        view.on_state_map('learner_policy', Policy(7, 3, 2, action))
        assert view.snapshot.reports.learner_policy is None
    for trust in ([0.5] * 5, [1.5] * 6, [float('nan')] * 6):
        view.on_state_map('trust', Trust(7, 3, 2, trust))
        assert view.snapshot.reports.trust is None


def test_a_state_outside_of_the_grid_is_not_shown(view):
    view.observe(StateReward(7, 1, 0, 0, 0.0, False, False))
    view.observe(StateReward(7, 1, 1, 99, 0.0, False, False))
    assert view.snapshot.reports.observation.state == 0


def test_a_world_that_comes_back_with_another_run_is_followed(view):
    view.observe(StateReward(7, 3, 1, 0, 0.0, False, False))
    view.on_world(describe(GRID, 'small', run=9, began=2.0))
    assert view.snapshot.description.run == 7
    for step in range(3):
        view.look()
        view.observe(StateReward(9, 1, step, 1, 0.0, False, False))
    view.look()
    assert view.snapshot.description.run == 9 and view.snapshot.reports.observation.step == 2


def test_reports_of_many_runs_are_bounded_and_the_shown_run_is_never_removed(view):
    view.on_progress(progress(7, 1))
    for run in range(100, 200):
        view.on_progress(progress(run, 1))
    assert view.snapshot.reports.curve.iterations == (1,)
    assert len(view.reports) <= MAX_RUNS
