# SPDX-License-Identifier: Apache-2.0
"""Action values of the planners, by examples worked by hand."""

import pytest
from tiny_worlds import Bench, room

from comply_ros.learner.learner_state import LARGEST_REWARD, OUTCOMES, TERMINAL
from comply_ros.learner.planned_values import (
    chance,
    plan_state,
    planned_value,
    unknown_value,
)
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP


def planning(planner, *outcomes, s=4, a=RIGHT, **settings):
    """Return a bench in which state 5 is worth 6, and a had outcomes (samples, successor, r)."""
    settings = {'initial_value': 10.0, 'untried_value': 0.0, **settings}
    bench = Bench(room(), planner=planner, discount=0.9, **settings)
    bench.state.departures[5] = 2.0
    bench.state.q[5] = [6.0, -float('inf'), 4.0, 2.0]
    see(bench, s, a, *outcomes)
    return bench


def see(bench, s, a, *outcomes):
    """Change the model: action a of state s had these outcomes."""
    for k, outcome in enumerate(outcomes):
        bench.state.model[s, a, k] = outcome
    bench.state.visits[s, a] += sum(outcome[0] for outcome in outcomes)


def value(as_run, bench):
    """Return the value of RIGHT in state 4."""
    return as_run(planned_value)(4, RIGHT, bench.kernel_config, bench.state)


# Three samples led to state 5 (-1 + 0.9 * 6 = 4.4), one to the goal (10).
FOUR_SAMPLES = (3, 5, -1.0), (1, TERMINAL, 10.0)


def test_a_value_is_the_mean_over_the_samples(as_run):  # (3 * 4.4 + 10) / 4
    assert value(as_run, planning('prioritized_sweeping', *FOUR_SAMPLES)) == pytest.approx(5.8)


@pytest.mark.parametrize('planner', ['prioritized_sweeping', 'r_max', 'mbie_eb', 'psrl'])
def test_an_action_never_tried_has_the_initial_value(as_run, planner):
    assert value(as_run, planning(planner)) == 10.0


@pytest.mark.parametrize(('known_after', 'expected'), [(5, 10.0), (4, 5.8)])
def test_r_max_does_not_count_an_action_before_it_is_known(as_run, known_after, expected):
    bench = planning('r_max', *FOUR_SAMPLES, known_after=known_after)
    assert value(as_run, bench) == pytest.approx(expected)


def test_mbie_eb_adds_a_bonus_that_falls_with_the_root_of_the_samples(as_run):  # 0.6 / sqrt(4)
    bench = planning('mbie_eb', *FOUR_SAMPLES, count_bonus=0.6)
    assert value(as_run, bench) == pytest.approx(5.8 + 0.3)


def test_psrl_counts_an_outcome_by_its_share_in_the_model_drawn(as_run):
    # 0.7 * 4.4 + 0.2 * 10, and 0.1 * 10 of what was not seen yet
    bench = planning('psrl', *FOUR_SAMPLES)
    bench.state.sampled[4, RIGHT, :2] = 0.7, 0.2
    bench.state.sampled[4, RIGHT, OUTCOMES] = 0.1
    assert value(as_run, bench) == pytest.approx(3.08 + 2.0 + 1.0)


def test_what_is_not_known_has_a_share_of_the_largest_reward(as_run):  # 2 + 0.5 * 8
    bench = planning('r_max', (5, 7, -1.0), initial_value=2.0, untried_value=0.5)
    bench.state.pooled[LARGEST_REWARD] = 8.0
    assert as_run(unknown_value)(bench.kernel_config, bench.state) == 6.0
    assert value(as_run, bench) == pytest.approx(-1.0 + 0.9 * 6.0)  # state 7 was never left


def test_all_actions_of_a_state_are_computed_at_once(as_run):
    # Before, 10 was the highest; RIGHT is now 5.8, UP -1 + 0.9 * 6, and the others 3.
    bench = planning('prioritized_sweeping', *FOUR_SAMPLES)
    for a, outcome in ((UP, (1, 5, -1.0)), (LEFT, (2, TERMINAL, 3.0)), (DOWN, (1, TERMINAL, 3.0))):
        see(bench, 4, a, outcome)
    change = as_run(plan_state)(4, bench.kernel_config, bench.state)
    assert bench.state.q[4, [RIGHT, UP, LEFT, DOWN]].tolist() == pytest.approx([5.8, 4.4, 3, 3])
    assert change == pytest.approx(10.0 - 5.8)


def test_an_action_that_the_state_does_not_have_gets_no_value(as_run):
    bench = planning('r_max')
    as_run(plan_state)(5, bench.kernel_config, bench.state)
    assert bench.state.q[5].tolist() == [10.0, -float('inf'), 10.0, 10.0]


def test_the_chance_of_a_successor_is_that_of_the_action_that_leads_there_most_often(as_run):
    bench = planning('r_max', *FOUR_SAMPLES)
    see(bench, 4, UP, (1, 7, -1.0), (1, 5, -1.0))
    for successor, expected in ((5, 0.75), (7, 0.5), (3, 0.0)):
        assert as_run(chance)(4, successor, bench.kernel_config, bench.state) == expected
