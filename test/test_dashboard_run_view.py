# SPDX-License-Identifier: Apache-2.0
"""One that hears a lesson: what it keeps, and what it leaves out."""

import numpy as np
import pytest
from tiny_worlds import grid

from comply_ros.dashboard.run_view import Onlooker, RUNS
from comply_ros.protocol.messages import describe, Policy, Progress, StateReward, Trust

GRID = grid('..G', '...')


@pytest.fixture
def onlooker():
    onlooker = Onlooker()
    onlooker.on_world(describe(GRID, 'small', run=7, began=1.0))
    return onlooker


def progress(run, iteration, mean_return=0.0):
    """Return a `Progress` without end."""
    return Progress(run, iteration, 0, 15, 100 * iteration, mean_return, 0.5, 1.0, False)


def test_it_sees_nothing_before_a_world():
    onlooker = Onlooker()
    onlooker.on_trust(Trust(7, 3, 2, [0.5] * 6))
    assert onlooker.sight.world is None and onlooker.sight.heard.trust is None


def test_a_state_that_came_before_its_world_is_seen_with_it():
    onlooker = Onlooker()
    onlooker.observe(StateReward(7, 1, 0, GRID.starts[0], 0.0, False, False))
    onlooker.on_world(describe(GRID, 'small', run=7))
    assert onlooker.sight.heard.question.state == GRID.starts[0]


def test_reports_that_came_before_their_world_are_kept():
    onlooker = Onlooker()
    onlooker.on_trust(Trust(7, 3, 2, [0.5] * 6))
    onlooker.on_progress(progress(7, 1))
    onlooker.on_world(describe(GRID, 'small', run=7))
    assert onlooker.sight.heard.trust.tolist() == [0.5] * 6
    assert onlooker.sight.heard.curve.iterations == (1,)


def test_reports_of_another_run_are_not_shown(onlooker):
    onlooker.on_progress(progress(8, 1))
    onlooker.on_mentor_policy(Policy(8, 3, 2, [0] * 6))
    assert onlooker.sight.heard.progress is None and onlooker.sight.heard.advice is None


def sample_maps_that_cannot_be_of_this_world_are_left_out(onlooker):
    onlooker.on_mentor_policy(Policy(7, 3, 2, [1, 1, 3, 1, 1, -1]))
    assert onlooker.sight.heard.advice.dtype == np.int8
    for action in ([0] * 6, [0] * 5, [9] * 6):  # the first would leave the grid
        onlooker.on_policy(Policy(7, 3, 2, action))
        assert onlooker.sight.heard.policy is None
    for trust in ([0.5] * 5, [1.5] * 6, [float('nan')] * 6):
        onlooker.on_trust(Trust(7, 3, 2, trust))
        assert onlooker.sight.heard.trust is None


def test_a_state_outside_of_the_grid_is_not_shown(onlooker):
    onlooker.observe(StateReward(7, 1, 0, 0, 0.0, False, False))
    onlooker.observe(StateReward(7, 1, 1, 99, 0.0, False, False))
    assert onlooker.sight.heard.question.state == 0


def test_a_world_that_comes_back_with_another_run_is_followed(onlooker):
    onlooker.observe(StateReward(7, 3, 1, 0, 0.0, False, False))
    onlooker.on_world(describe(GRID, 'small', run=9, began=2.0))
    assert onlooker.sight.described.run == 7
    for step in range(3):
        onlooker.look()
        onlooker.observe(StateReward(9, 1, step, 1, 0.0, False, False))
    onlooker.look()
    assert onlooker.sight.described.run == 9 and onlooker.sight.heard.question.step == 2


def test_a_flood_of_runs_neither_grows_nor_pushes_out_the_one_that_is_shown(onlooker):
    onlooker.on_progress(progress(7, 1))
    for run in range(100, 200):
        onlooker.on_progress(progress(run, 1))
    assert onlooker.sight.heard.curve.iterations == (1,)
    assert len(onlooker._runs) <= RUNS
