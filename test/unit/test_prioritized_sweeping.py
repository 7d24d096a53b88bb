# SPDX-License-Identifier: Apache-2.0
"""What a planner changes after a step and when an episode begins, by examples worked by hand."""

import numpy as np
import pytest
from tiny_worlds import Bench, corridor, grid

from comply_ros.learner.learner_state import OUTCOMES
from comply_ros.learner.prioritized_sweeping import learn_and_sweep, plan_episode
from comply_ros.world.grid import LEFT, RIGHT
from comply_ros.world.mdp import World


def learned(as_run, bench, *steps, a=RIGHT, u=0.3):
    """Return the state after steps of (state, reward, successor, done) with one action."""
    for s, r, s2, done in steps:
        bench.state.departures[s] += 1.0
        as_run(learn_and_sweep)(s, a, r, s2, done, u, bench.kernel_config, bench.state)
    return bench.state


def test_a_reward_reaches_the_states_that_lead_there_at_once(as_run):  # -1 + 0.9 * 10
    bench = Bench(corridor(), planner='prioritized_sweeping', untried_value=0.0, discount=0.9)
    state = learned(as_run, bench, (0, -1.0, 1, False), (1, 10.0, 2, True))
    assert state.q[[0, 1], RIGHT].tolist() == pytest.approx([8.0, 10.0])
    assert state.queue[0] == 0


def test_an_action_that_stays_where_it_is_half_of_the_time(as_run):
    # V = 0.5 (-1 + 0.9 * 10) + 0.5 (-1 + 0.9 V), so V = 3.5 / 0.55
    bench = Bench(corridor(), planner='prioritized_sweeping', untried_value=0.0, discount=0.9)
    state = learned(as_run, bench, (0, -1.0, 1, False), (1, 10.0, 2, True), (0, -1.0, 0, False))
    assert state.q[0, RIGHT] == pytest.approx(3.5 / 0.55, abs=0.05)


def test_what_becomes_known_to_r_max_changes_the_states_before(as_run):
    # As long as LEFT is unknown, state 1 is worth 10. Known, it leads back to 0, and 1 is worth 3.
    bench = Bench(corridor(), planner='r_max', known_after=2, initial_value=10.0,
                  untried_value=0.0, discount=0.9)
    twice = 2 * ((0, -1.0, 1, False),) + 2 * ((1, 3.0, 2, True),)
    state = learned(as_run, bench, *twice)
    assert state.q[[0, 1], RIGHT].tolist() == pytest.approx([-1.0 + 0.9 * 10.0, 3.0])
    state = learned(as_run, bench, *2 * ((1, -1.0, 0, False),), a=LEFT)
    assert state.q[[0, 1], RIGHT].tolist() == pytest.approx([-1.0 + 0.9 * 3.0, 3.0])
    assert state.q[1, LEFT] == pytest.approx(-1.0 + 0.9 * 1.7)


def test_at_most_twenty_states_are_computed_after_the_one_that_was_left(as_run):
    bench = Bench(World(grid(31 * '.' + 'G')), planner='prioritized_sweeping', untried_value=0.0)
    steps = [(s, -0.1, s + 1, False) for s in range(30)]
    state = learned(as_run, bench, *steps, (30, 10.0, 31, True))
    assert np.flatnonzero(state.q[:, RIGHT] > 5.0).tolist() == list(range(10, 31))
    assert (state.queue[0], state.queue[1]) == (1, 9)


def psrl(samples=1):
    """Return a bench of PSRL in which the goal was reached in some samples, never planned yet."""
    bench = Bench(corridor(), planner='psrl', unseen_weight=0.5, initial_value=2.0,
                  untried_value=0.0, discount=0.9)
    bench.state.model[0, RIGHT, 0] = samples, 1, -1.0
    bench.state.model[1, RIGHT, 0] = samples, -1, 10.0
    bench.state.visits[[0, 1], RIGHT] += samples
    bench.state.departures[[0, 1]] += samples
    bench.state.pooled[3] = 10.0
    return bench


def begun(as_run, bench, u=0.5):
    """Return the state after an episode began."""
    as_run(plan_episode)(u, 0.5, bench.kernel_config, bench.state)
    return bench.state


def test_psrl_plans_in_the_model_that_it_draws(as_run):
    state = begun(as_run, psrl())
    known = 1.0 - state.sampled[[0, 1], RIGHT, OUTCOMES]
    assert (0.0 < known).all() and (known < 1.0).all()
    goal = known[1] * 10.0 + (1.0 - known[1]) * 2.0
    first = known[0] * (-1.0 + 0.9 * goal) + (1.0 - known[0]) * 2.0
    assert state.q[[0, 1], RIGHT].tolist() == pytest.approx([first, goal])


def test_each_episode_has_a_model_of_its_own_that_depends_on_its_first_draws_alone(as_run):
    first, again, other = (begun(as_run, psrl(), u).sampled for u in (0.5, 0.5, 0.6))
    assert (first == again).all()
    assert (first != other).any()


def test_with_many_samples_psrl_plans_in_the_true_model(as_run):
    state = begun(as_run, psrl(10 ** 7))
    assert state.q[[0, 1], RIGHT].tolist() == pytest.approx([8.0, 10.0], abs=1e-3)


def test_within_an_episode_psrl_draws_anew_where_the_samples_have_doubled(as_run):
    bench = Bench(corridor(), planner='psrl', discount=0.9)
    changed, before = [], bench.state.sampled.copy()
    for n in range(1, 9):
        state = learned(as_run, bench, (1, 10.0, 2, True), u=n / 10)
        if (state.sampled != before).any():
            changed.append(n)
        before = state.sampled.copy()
    assert changed == [1, 2, 4, 8]


def test_other_planners_draw_nothing(as_run):
    bench = Bench(corridor(), planner='r_max', discount=0.9)
    before = bench.state.digest()
    assert begun(as_run, bench).digest() == before
    assert bench.state.sampled.size == 0
