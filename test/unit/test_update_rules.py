# SPDX-License-Identifier: Apache-2.0
"""Updates from one transition: every formula by an example worked by hand."""

import numpy as np
import pytest
from tiny_worlds import advised, Bench, room

from comply_ros.learner.action_choice import expected_value
from comply_ros.learner.update_rules import decay_schedules, learn, learning_rate
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP

HALF = {'learning_rate': 0.5, 'learning_rate_exponent': 1.0, 'discount': 0.9}


def step(as_run, bench, done=False, advice=-1, a=RIGHT):
    """Learn from (4, a, -1, 5, UP) with q[4] = 2 and q[5] = (1, -inf, 6, 4); return the state."""
    bench.state.q[4] = 2.0
    bench.state.q[5] = [1.0, -np.inf, 6.0, 4.0]
    as_run(learn)(4, a, -1.0, 5, UP, done, advised(advice), 0.0, bench.kernel_config, bench.state)
    return bench.state


def test_sarsa_learns_towards_the_chosen_action(as_run):  # (2.15): 2 + 0.5 (-1 + 0.9*4 - 2)
    assert step(as_run, Bench(room(), **HALF)).q[4, RIGHT] == pytest.approx(2.3)


def test_undiscounted_sarsa(as_run):  # (3.3): 2 + 0.5 (-1 + 4 - 2)
    state = step(as_run, Bench(room(), **{**HALF, 'discount': 1.0}))
    assert state.q[4, RIGHT] == pytest.approx(2.5)


def test_q_learning_learns_towards_the_best_action(as_run):  # (2.17): 2 + 0.5 (-1 + 0.9*6 - 2)
    assert step(as_run, Bench(room(), off_policy=True, **HALF)).q[4, RIGHT] == pytest.approx(3.2)


@pytest.mark.parametrize('off_policy', [False, True])
def test_a_terminal_state_has_the_value_0(as_run, off_policy):  # 2 + 0.5 (-1 - 2)
    state = step(as_run, Bench(room(), off_policy=off_policy, **HALF), done=True)
    assert state.q[4, RIGHT] == pytest.approx(0.5)


def test_a_step_counts_where_it_was_taken(as_run):
    state = step(as_run, Bench(room(), visit_growth=0.25, **HALF))
    assert state.visits[4].tolist() == [1.0, 1.25, 1.0, 1.0]
    assert state.departures[4] == 2.0
    assert state.visits.sum() == 36.25 and state.departures.sum() == 10.0
    assert state.q[4].tolist() == pytest.approx([2.0, 2.3, 2.0, 2.0])


def test_expected_sarsa_learns_towards_the_mean_of_what_it_would_choose(as_run):
    # epsilon 0.3: the best of (1, 6, 4) is 6, the mean 11/3; 2 + 0.5 (-1 + 0.9 (0.7*6 + 1.1) - 2)
    state = step(as_run, Bench(room(), expects=True, epsilon=0.3, **HALF))
    assert state.q[4, RIGHT] == pytest.approx(2.0 + 0.5 * (-1.0 + 0.9 * 5.3 - 2.0))


def test_expected_sarsa_with_a_softmax(as_run):  # weights 1, e, e^2 of the values 0, 1, 2
    bench = Bench(room(), expects=True, temperature=1.0, **HALF)
    bench.state.q[5] = [0.0, -np.inf, 1.0, 2.0]
    e = np.e
    assert as_run(expected_value)(5, bench.kernel_config, bench.state) == pytest.approx(
        (e + 2 * e ** 2) / (1 + e + e ** 2))


@pytest.mark.parametrize(('u', 'tables'), [(0.2, (2.8, 1.0)), (0.7, (3.0, 3.6))])
def test_double_q_learning_learns_one_table_from_the_other(as_run, u, tables):
    # Q1(4, RIGHT) = 3, Q2 = 1; in state 5 Q1 = (1, -, 8, 5), Q2 = (1, -, 4, 3), both best at 2.
    # Q1: 3 + 0.5 (-1 + 0.9*4 - 3) = 2.8; or Q2: 1 + 0.5 (-1 + 0.9*8 - 1) = 3.6
    bench = Bench(room(), off_policy=True, doubles=True, **HALF)
    state = bench.state
    state.q[4, RIGHT], state.half_difference[4, RIGHT] = 2.0, 1.0
    state.q[5] = [1.0, -np.inf, 6.0, 4.0]
    state.half_difference[5] = [0.0, 0.0, 2.0, 1.0]
    as_run(learn)(4, RIGHT, -1.0, 5, UP, False, advised(-1), u, bench.kernel_config, state)
    q, half = state.q[4, RIGHT], state.half_difference[4, RIGHT]
    assert (q + half, q - half) == pytest.approx(tables)
    assert state.visits[4, RIGHT] == 2.0 and state.departures[4] == 2.0


def test_the_belief_learns_from_the_values_before_the_update(as_run):  # (3.8)
    # delta = -1 + 0.9*4 - q(4, LEFT) = 0.6; beta += 1 * 8 / 10 * 0.6 = 0.48
    bench = Bench(room(), trust='beta', trust_rate=1.0, **HALF)
    assert step(as_run, bench, advice=LEFT).belief[4, :2].tolist() == pytest.approx([8.0, 2.48])
    # the same where the advice was taken: alpha += 1 * 2 / 10 * 0.6 = 0.12, not of the updated q
    bench = Bench(room(), trust='beta', trust_rate=1.0, **HALF)
    assert step(as_run, bench, advice=RIGHT).belief[4, :2].tolist() == pytest.approx([8.12, 2.0])


def test_the_value_of_listening_learns_from_the_updated_value(as_run):  # (3.12) after (2.15)
    bench = Bench(room(), trust='explicit', trust_rate=0.1, updates_both=False,
                  belief_listen=1.0, **HALF)
    assert step(as_run, bench, advice=RIGHT).belief[4, 0] == pytest.approx(0.9 + 0.1 * 2.3)


def test_without_advice_the_belief_stays(as_run):
    bench = Bench(room(), trust='beta', **HALF)
    assert step(as_run, bench, advice=-1).belief[4, :2].tolist() == [8.0, 2.0]


@pytest.mark.parametrize('trust', ['none', 'scheduled', 'shaping', 'jump_start', 'head_start',
                                   'returns'])
def test_other_kinds_of_trust_leave_belief_and_pool_as_they_are(as_run, trust):
    bench = Bench(room(), trust=trust, **HALF)
    fresh = Bench(room(), trust=trust, **HALF).state
    state = step(as_run, bench, advice=LEFT)
    for name in ('belief', 'pool_size', 'pool_listen', 'pool_discard'):
        assert (getattr(state, name) == getattr(fresh, name)).all(), name


@pytest.mark.parametrize('c, e, rate', [
    (3.0, 0.55, 0.4371931),  # (2.26): 0.8 / 3^0.55 = 0.8 / 1.8298551
    (4.0, 1.0, 0.2), (4.0, 0.5, 0.4), (1.0, 0.55, 0.8)])
def test_the_learning_rate_falls_with_the_visits(as_run, c, e, rate):
    config = Bench(room(), learning_rate=0.8, learning_rate_exponent=e).kernel_config
    assert as_run(learning_rate)(c, config) == pytest.approx(rate, abs=1e-7)


def decayed(as_run, bench, *mean_returns):
    """Decay the schedules after iterations with these mean returns; return the state."""
    for mean_return in mean_returns:
        as_run(decay_schedules)(mean_return, bench.kernel_config, bench.state)
    return bench.state


def test_confidence_and_temperature_fall_after_an_iteration(as_run):  # (2.25), (3.6)
    bench = Bench(room(), temperature=0.5, temperature_factor=0.98, confidence=0.9,
                  confidence_factor=0.99)
    state = decayed(as_run, bench, 0.0)
    assert state.scheduled_confidence[0] == pytest.approx(0.891)
    assert state.temperature[0] == pytest.approx(0.49)


def test_the_temperature_has_a_floor_and_may_wait_for_the_confidence(as_run):
    bench = Bench(room(), temperature=0.5, temperature_factor=0.5, temperature_floor=0.3,
                  confidence=0.9, confidence_factor=0.7, cooling_confidence=0.5)
    # confidence 0.63, 0.441, 0.3087
    assert [decayed(as_run, bench, 0.0).temperature[0] for _ in range(3)] == [0.5, 0.3, 0.3]


def test_the_temperature_falls_as_soon_as_the_confidence_is_low_enough(as_run):
    bench = Bench(room(), temperature=0.5, temperature_factor=0.5, confidence=1.0,
                  confidence_factor=0.5, cooling_confidence=0.5)
    state = decayed(as_run, bench, 0.0)
    assert (state.scheduled_confidence[0], state.temperature[0]) == (0.5, 0.25)


def test_the_trust_rate_falls_after_an_iteration(as_run):
    bench = Bench(room(), trust_rate=2.0, trust_rate_factor=0.99)
    assert decayed(as_run, bench, 0.0).trust_rate[0] == pytest.approx(1.98)


def test_a_jump_start_gets_shorter_when_the_return_is_near_the_best(as_run):
    bench, stages = Bench(room(), guided_tolerance=0.1), []
    for mean_return in (-10.0, -10.9, -11.1, -5.0, -5.6):  # bounds: none, -11, -11, -11, -5.5
        stages.append(decayed(as_run, bench, mean_return).guided_stage[0])
    assert stages == [1.0, 2.0, 2.0, 3.0, 3.0]
    assert bench.state.best_return[0] == -5.0


def test_an_error_reaches_the_steps_before(as_run):  # the pseudo-code of Sarsa(lambda)
    # Three steps 3 -> 4 -> 5 of one episode: q 0, rate 0.5, gamma 0.9, lambda 0.5, r = -1.
    bench = Bench(room(), trace_decay=0.5, **HALF)
    for s, s2 in ((3, 4), (4, 5)):
        as_run(learn)(s, RIGHT, -1.0, s2, UP, False, advised(-1), 0.0, bench.kernel_config,
                      bench.state)
    # the second error of -1 reaches 3 with the trace 0.9 * 0.5: -0.5 - 0.5 * 0.45
    assert bench.state.q[[3, 4], RIGHT].tolist() == pytest.approx([-0.725, -0.5])
    assert bench.state.traces[[3, 4], RIGHT].tolist() == pytest.approx([0.2025, 0.45])


def watkins(as_run, a2, **settings):
    """Return the traces after a step from 4 to the right, before action a2, q[5] as in `step`."""
    bench = Bench(room(), trace_decay=0.5, off_policy=True, **settings, **HALF)
    bench.state.q[5] = [1.0, -np.inf, 6.0, 4.0]
    as_run(learn)(4, RIGHT, -1.0, 5, a2, False, advised(-1), 0.0, bench.kernel_config, bench.state)
    assert bench.state.q[4, RIGHT] == pytest.approx(0.5 * (-1.0 + 0.9 * 6.0))  # (2.17)
    return bench.state.traces.sum()


def test_watkins_cuts_the_traces_before_an_action_that_is_not_greedy(as_run):
    assert watkins(as_run, DOWN) == pytest.approx(0.45)
    assert watkins(as_run, UP) == 0.0
    assert watkins(as_run, UP, cuts_traces=False) == pytest.approx(0.45)


def test_on_policy_no_trace_is_cut(as_run):
    bench = Bench(room(), trace_decay=0.5, **HALF)
    assert step(as_run, bench).traces[4, RIGHT] == pytest.approx(0.45)
