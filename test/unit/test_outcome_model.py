# SPDX-License-Identifier: Apache-2.0
"""Values from counts of all outcomes and a prior of slips, by examples worked by hand."""

import numpy as np
import pytest
from tiny_worlds import advised, Bench, corridor, grid, model_bench, room, see

from comply_ros.learner.learner_state import (
    ALTERNATIVES,
    HITS,
    LARGEST_REWARD,
    OUTCOMES,
    SCALE,
    TERMINAL,
    TRIALS,
)
from comply_ros.learner.outcome_model import back_up, propagate, record_transition
from comply_ros.learner.update_rules import learn
from comply_ros.learner.usual_outcome_model import finish_episode
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP
from comply_ros.world.mdp import World

COST = 0.003  # of a step, where the largest reward is 10


def backed_up(as_run, bench, s=4):
    """Back up state s, and return its action values without the cost of a step."""
    as_run(back_up)(s, bench.kernel_config, bench.state)
    return bench.state.q[s] + COST * (bench.state.visits[s] > 1.0)


def test_a_value_is_that_of_the_samples_and_of_eight_more_of_the_prior(as_run):
    # RIGHT led twice to state 5 (-1 + 6 = 5), UP once to state 7 (-1 + 3 = 2). The prior of
    # RIGHT: 0.8 * 5 + 0.2 * 2 = 4.4, that of UP: 0.8 * 2 + 0.2 * 5 = 2.6. What was never tried
    # has 0.65 of the largest reward.
    bench = model_bench()
    bench.state.values[[5, 7]] = 6.0, 3.0
    see(bench, RIGHT, (2, 5, -1.0))
    see(bench, UP, (1, 7, -1.0))
    q = backed_up(as_run, bench)
    assert q[RIGHT] == pytest.approx((2 * 5 + 8 * 4.4) / 10)
    assert q[UP] == pytest.approx((2 + 8 * 2.6) / 9)
    assert q[[LEFT, DOWN]].tolist() == [6.5, 6.5]
    assert bench.state.values[4] == 6.5


def test_the_discount_is_that_of_the_settings(as_run):
    bench = model_bench(discount=0.5)
    bench.state.values[5] = 6.0
    see(bench, RIGHT, (1, 5, -1.0))
    assert backed_up(as_run, bench)[RIGHT] == pytest.approx(-1.0 + 0.5 * 6.0)


def test_the_end_of_an_episode_has_the_value_0(as_run):
    bench = model_bench()
    see(bench, RIGHT, (3, TERMINAL, 10.0))
    assert backed_up(as_run, bench)[RIGHT] == pytest.approx(10.0)


def test_an_outcome_that_another_action_has_more_often_may_be_a_slip(as_run):
    # LEFT led to state 5 once, as RIGHT did twice: its usual outcome counts as unknown, 6.5. The
    # prior of LEFT: 0.8 * 6.5 + 0.2 * 5 = 6.2.
    bench = model_bench()
    bench.state.values[5] = 6.0
    see(bench, RIGHT, (2, 5, -1.0))
    see(bench, LEFT, (1, 5, -1.0))
    assert backed_up(as_run, bench)[LEFT] == pytest.approx((5 + 8 * 6.2) / 9)


def recorded(as_run, *steps):
    """Return the state after steps of (reward, successor, done) with RIGHT in state 4."""
    bench = Bench(room(), learns_model=True)
    for r, s2, done in steps:
        as_run(record_transition)(4, RIGHT, r, s2, done, bench.state)
    return bench.state


def test_each_outcome_has_its_count_and_its_mean_reward(as_run):
    state = recorded(as_run, (-1.0, 5, False), (-5.0, 4, False), (-2.0, 5, False),
                     (10.0, 8, True))
    assert state.model[4, RIGHT, :4].tolist() == [
        [2.0, 5.0, -1.5], [1.0, 4.0, -5.0], [1.0, TERMINAL, 10.0], [0.0, 0.0, 0.0]]
    assert state.visits[4, RIGHT] == 5.0
    assert (state.pooled[LARGEST_REWARD], state.pooled[SCALE]) == (10.0, 10.0)


def test_rewards_are_compared_with_the_mean_of_their_own_outcome(as_run):
    # -1 and -2 differ from their mean by 0.5 each; -5 is of another outcome.
    state = recorded(as_run, (-1.0, 5, False), (-5.0, 4, False), (-2.0, 5, False))
    assert state.reward_squares[4, RIGHT] == pytest.approx(0.5)


def test_the_slip_prior_counts_from_the_third_time_on(as_run):
    state = recorded(as_run, *((-1.0, s2, False) for s2 in (5, 5, 5, 7, 5)))
    assert (state.pooled[HITS], state.pooled[TRIALS]) == (2.0, 3.0)


def test_an_action_that_is_new_beside_another_is_counted_once(as_run):
    bench = Bench(room(), learns_model=True)
    for a, beside in ((RIGHT, 0), (RIGHT, 0), (UP, 1), (UP, 1), (LEFT, 2)):
        as_run(learn)(4, a, -1.0, 4, a, False, advised(-1), 0.0, bench.kernel_config, bench.state)
        assert bench.state.pooled[ALTERNATIVES] == beside


def test_an_outcome_too_many_is_counted_with_the_rarest(as_run):
    first = [(-1.0, s2, False) for s2 in (0, 1, 2, 3, 4, 5, 6, 7)]
    state = recorded(as_run, *first, *first[:7], (10.0, 8, True))
    assert state.model[4, RIGHT, :, 0].tolist() == [2.0] * OUTCOMES
    assert state.model[4, RIGHT, 7].tolist() == [2.0, TERMINAL, 4.5]  # the mean of -1 and 10


def test_a_state_knows_sixteen_that_lead_to_it_at_most(as_run):
    bench = Bench(corridor(), learns_model=True)
    bench.state.predecessors[1, :3] = [2, 7, 0]
    as_run(record_transition)(2, LEFT, -1.0, 1, False, bench.state)
    as_run(record_transition)(0, RIGHT, -1.0, 1, False, bench.state)  # is there
    assert bench.state.predecessors[1, :4].tolist() == [3, 7, 0, 2]
    bench.state.predecessors[1, 0] = 16
    as_run(record_transition)(1, LEFT, -1.0, 1, False, bench.state)
    assert (bench.state.predecessors[1, 0], bench.state.predecessors[1, 4:].any()) == (16, False)


def test_a_reward_is_passed_on_to_the_states_that_lead_there_at_once(as_run):
    # 0 leads to 1, and 1 to the goal with 10: 0 is worth 9 before it is seen again.
    bench = Bench(corridor(), learns_model=True)
    for s, r, s2, done in ((0, -1.0, 1, False), (1, 10.0, 2, True)):
        as_run(learn)(s, RIGHT, r, s2, -1 if done else RIGHT, done, advised(-1), 0.0,
                      bench.kernel_config, bench.state)
    assert bench.state.q[0, RIGHT] == pytest.approx(9.0 - 2 * COST)
    assert bench.state.queue[1] == 0  # nobody waits any more


def test_one_step_backs_up_twenty_states_at_most(as_run):
    bench = Bench(World(grid(*(5 * ['......'] + ['.....G']))), learns_model=True)
    state = bench.state
    state.queue[:2], state.queue[2:], state.queued[:] = (30, 36), np.arange(36), 1
    as_run(propagate)(bench.kernel_config, state)
    assert state.queue[:2].tolist() == [14, 16]  # the ring has 36 places
    assert np.flatnonzero(state.queued).tolist() == list(range(14, 30))


def test_a_step_that_leads_nowhere_counts_twice_among_the_returns_to_its_state(as_run):
    bench = Bench(corridor(), learns_model=True)
    counts = []
    for successor in (1, 0):
        as_run(learn)(0, RIGHT, -1.0, successor, RIGHT, False, advised(-1), 0.0,
                      bench.kernel_config, bench.state)
        counts.append(bench.state.traces[0, 0])
    assert counts == [1.0, 3.0]


def test_the_end_of_an_episode_backs_up_its_states_and_forgets_it(as_run):
    bench = Bench(corridor(), learns_model=True)
    as_run(learn)(0, RIGHT, -1.0, 1, RIGHT, False, advised(-1), 0.0, bench.kernel_config,
                  bench.state)
    bench.state.values[1] = 5.0
    as_run(finish_episode)(bench.kernel_config, bench.state)
    assert bench.state.q[0, RIGHT] == pytest.approx(4.0, abs=0.01)
    assert (bench.state.trail[0], bench.state.traces.any()) == (0, False)


def test_a_backup_keeps_how_much_the_samples_of_an_action_vary(as_run):
    bench = model_bench()
    bench.state.values[5] = 3.0
    see(bench, RIGHT, (3, 5, 1.0), (1, TERMINAL, 2.0))  # 4, 4, 4 and 2: squares of 3 x 0.25 + 2.25
    see(bench, UP, (3, TERMINAL, 0.1))  # the sum of their squares is rounded
    bench.state.reward_squares[4, UP] = 0.5  # rewards of the same outcome
    as_run(back_up)(4, bench.kernel_config, bench.state)
    assert bench.state.sample_squares[4].tolist() == pytest.approx([0.0, 3.0, 0.0, 0.5])
    bench.state.reward_squares[4, UP] = 0.0
    as_run(back_up)(4, bench.kernel_config, bench.state)
    assert bench.state.sample_squares[4].min() >= 0.0
