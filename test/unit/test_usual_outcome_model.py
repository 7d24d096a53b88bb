# SPDX-License-Identifier: Apache-2.0
"""Action values from a model of usual outcomes, by examples worked by hand."""

import numpy as np
import pytest
from tiny_worlds import advised, Bench, corridor, FOUR, room

from comply_ros.learner.update_rules import learn
from comply_ros.learner.usual_outcome_model import (
    backup,
    finish_episode,
    record_outcome,
    REWARD,
    SUCCESSOR,
    TERMINAL,
    VOTES,
)
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP


def outcome_after(as_run, *steps):
    """Return the outcome of an action after steps of (reward, successor, done)."""
    outcomes = np.zeros((9, 4, 3))
    for count, (r, s2, done) in enumerate(steps, 1):
        as_run(record_outcome)(4, RIGHT, r, s2, done, float(count), outcomes)
    return outcomes[4, RIGHT].tolist()


def test_the_first_outcome_is_the_usual_one(as_run):
    assert outcome_after(as_run, (-1.0, 5, False)) == [-1.0, 5.0, 1.0]


def test_the_usual_successor_is_that_of_the_majority(as_run):
    steps = [(-1.0, s2, False) for s2 in (3, 5, 5, 5, 1, 5)]  # a slip first, another later
    outcome = outcome_after(as_run, *steps)
    assert outcome[SUCCESSOR] == 5.0
    assert outcome[VOTES] == 3.0  # 1 for 3; 5 takes over with 1, 2, 3, then 2, 3


def test_the_reward_is_the_mean(as_run):  # -1, -5, -3: the third is a third of the way
    assert outcome_after(as_run, *((r, 5, False) for r in (-1.0, -5.0, -3.0)))[REWARD] == -3.0


def test_a_slip_into_the_goal_leaves_the_reward_as_it_is(as_run):
    steps = [(-1.0, 5, False), (-1.0, 5, False), (10.0, 8, True)]
    assert outcome_after(as_run, *steps) == [-1.0, 5.0, 1.0]


def test_an_action_that_usually_ends_the_episode_has_the_reward_of_the_end(as_run):
    steps = [(-1.0, 5, False), (10.0, 8, True)]
    assert outcome_after(as_run, *steps) == [10.0, TERMINAL, 1.0]


def test_a_backup_adds_the_reward_and_the_best_value_of_the_successor(as_run):
    bench = Bench(room(), replays=True, initial_value=3.0)
    bench.state.q[5] = [1.0, -np.inf, 6.0, 4.0]
    bench.state.visits[4, [RIGHT, UP]] = 2.0
    bench.state.outcomes[4, RIGHT] = [-1.0, 5.0, 1.0]
    bench.state.outcomes[4, UP] = [10.0, TERMINAL, 1.0]
    as_run(backup)(4, 0.5, bench.state.q, bench.state.visits, bench.state.outcomes, FOUR)
    # right: -1 + 0.5 * 6; up ends the episode; left and down were never tried
    assert bench.state.q[4].tolist() == [3.0, 2.0, 3.0, 10.0]


def walked(as_run, *steps, **settings):
    """Return a bench after steps (s, a, r, s2, done) of one episode."""
    bench = Bench(room(), replays=True, off_policy=True, initial_value=0.0, **settings)
    for s, a, r, s2, done in steps:
        as_run(learn)(s, a, r, s2, LEFT, done, advised(-1), 0.0, bench.kernel_config, bench.state)
    return bench


EPISODE = ((3, RIGHT, -1.0, 4, False), (4, RIGHT, -1.0, 5, False), (5, UP, 10.0, 8, True))


def test_a_step_changes_values_at_once_only_where_it_was_taken(as_run):
    bench = walked(as_run, *EPISODE)
    assert bench.state.q[[3, 4, 5], [RIGHT, RIGHT, UP]].tolist() == [-1.0, -1.0, 10.0]
    assert bench.state.visits[3, RIGHT] == 2.0 and bench.state.departures[3] == 2.0
    assert bench.state.trail[:4].tolist() == [3, 12, 16, 20]


def test_the_end_of_an_episode_backs_up_its_states_last_one_first(as_run):
    bench = walked(as_run, *EPISODE)
    state = bench.state
    as_run(finish_episode)(bench.kernel_config, state)
    assert state.q[[3, 4, 5], [RIGHT, RIGHT, UP]].tolist() == [8.0, 9.0, 10.0]
    assert state.trail[0] == 0 and not state.traces.any()


def test_a_state_is_listed_once_an_episode(as_run):
    bench = walked(as_run, (3, DOWN, -1.0, 3, False), (3, DOWN, -1.0, 3, False))
    assert bench.state.trail[:3].tolist() == [1, 12, 0]


def test_the_end_of_an_episode_changes_no_values_without_a_model(as_run):
    bench = Bench(corridor(), trace_decay=0.5)
    state = bench.state
    state.traces[1, 1], state.trail[:2] = 1.0, (1, 5)
    before = state.q.copy()
    as_run(finish_episode)(bench.kernel_config, state)
    assert (state.q == before).all() and state.trail[0] == 0


@pytest.mark.parametrize('done', [False, True])
def test_the_rewards_of_an_end_and_of_a_move_are_never_averaged(as_run, done):
    steps = [(-1.0, 5, False)] * 3 + [(10.0, 8, True)] * (3 if done else 1)
    outcome = outcome_after(as_run, *steps)
    assert outcome[REWARD] == (10.0 if outcome[SUCCESSOR] == TERMINAL else -1.0)
