# SPDX-License-Identifier: Apache-2.0
"""One step of a learner: every formula by an example worked by hand."""

import numpy as np
import pytest
from tiny_worlds import Bench, corridor, room

from comply_ros.learner.learner_state import (
    BEST_RETURN,
    CONFIDENCE,
    STAGE,
    TEMPERATURE,
    TRUST_RATE,
)
from comply_ros.learner.update_rules import (
    choose,
    decay_schedules,
    drawn,
    learn,
    learning_rate,
    softmax_action,
)
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP

HALF = {'learning_rate': 0.5, 'learning_rate_exponent': 1.0, 'discount': 0.9}


def step(as_run, bench, done=False, advice=-1, a=RIGHT):
    """Learn from (4, a, -1, 5, UP) with q[4, RIGHT] = 2 and q[5] = (1, -inf, 6, 4)."""
    bench.memory.q[4] = 2.0
    bench.memory.q[5] = [1.0, -np.inf, 6.0, 4.0]
    as_run(learn)(4, a, -1.0, 5, UP, done, advice, bench.numbers, *bench.arrays)
    return bench.memory


def test_sarsa_learns_towards_the_chosen_action(as_run):  # (2.15): 2 + 0.5 (-1 + 0.9*4 - 2)
    assert step(as_run, Bench(room(), **HALF)).q[4, RIGHT] == pytest.approx(2.3)


def test_undiscounted_sarsa(as_run):  # (3.3): 2 + 0.5 (-1 + 4 - 2)
    memory = step(as_run, Bench(room(), **{**HALF, 'discount': 1.0}))
    assert memory.q[4, RIGHT] == pytest.approx(2.5)


def test_q_learning_learns_towards_the_best_action(as_run):  # (2.17): 2 + 0.5 (-1 + 0.9*6 - 2)
    assert step(as_run, Bench(room(), off_policy=True, **HALF)).q[4, RIGHT] == pytest.approx(3.2)


@pytest.mark.parametrize('off_policy', [False, True])
def test_after_a_terminal_state_nothing_follows(as_run, off_policy):  # 2 + 0.5 (-1 - 2)
    memory = step(as_run, Bench(room(), off_policy=off_policy, **HALF), done=True)
    assert memory.q[4, RIGHT] == pytest.approx(0.5)


def test_a_step_counts_where_it_was_taken(as_run):
    memory = step(as_run, Bench(room(), visit_growth=0.25, **HALF))
    assert memory.visits[4].tolist() == [1.0, 1.25, 1.0, 1.0]
    assert memory.arrivals[4] == 2.0
    assert memory.visits.sum() == 36.25 and memory.arrivals.sum() == 10.0
    assert memory.q[4].tolist() == pytest.approx([2.0, 2.3, 2.0, 2.0])


def test_the_belief_learns_from_the_values_before_the_update(as_run):  # (3.8)
    # delta = -1 + 0.9*4 - q(4, LEFT) = 0.6; beta += 1 * 8 / 10 * 0.6 = 0.48
    bench = Bench(room(), trust='beta', trust_rate=1.0, **HALF)
    assert step(as_run, bench, advice=LEFT).belief[4, :2].tolist() == pytest.approx([8.0, 2.48])
    # the same where the advice was taken: alpha += 1 * 2 / 10 * 0.6 = 0.12, not of the updated q
    bench = Bench(room(), trust='beta', trust_rate=1.0, **HALF)
    assert step(as_run, bench, advice=RIGHT).belief[4, :2].tolist() == pytest.approx([8.12, 2.0])


def test_listening_is_worth_the_updated_value(as_run):  # (3.12) comes after (2.15)
    bench = Bench(room(), trust='explicit', trust_rate=0.1, updates_both=False,
                  belief_listen=1.0, **HALF)
    assert step(as_run, bench, advice=RIGHT).belief[4, 0] == pytest.approx(0.9 + 0.1 * 2.3)


def test_without_advice_the_belief_learns_nothing(as_run):
    bench = Bench(room(), trust='beta', **HALF)
    assert step(as_run, bench, advice=-1).belief[4, :2].tolist() == [8.0, 2.0]


@pytest.mark.parametrize('c, e, rate', [
    (3.0, 0.55, 0.4371931),  # (2.26): 0.8 / 3^0.55 = 0.8 / 1.8298551
    (4.0, 1.0, 0.2), (4.0, 0.5, 0.4), (1.0, 0.55, 0.8)])
def test_the_learning_rate_falls_with_the_visits(as_run, c, e, rate):
    numbers = Bench(room(), learning_rate=0.8, learning_rate_exponent=e).numbers
    assert as_run(learning_rate)(c, numbers) == pytest.approx(rate, abs=1e-7)


# (2.24) with q = (1, 2, -inf, 0), temperature 0.5: weights e^-2, 1, 0, e^-4 = 0.1353353, 1, 0,
# 0.0183156; their sum is 1.1536509, so the shares end at 0.1173105, 0.9841238, 0.9841238, 1.
@pytest.mark.parametrize('u, action', [
    (0.0, LEFT), (0.11731, LEFT), (0.11732, RIGHT), (0.98412, RIGHT), (0.98413, UP),
    (0.9999999999999999, UP)])
def test_softmax_shares(as_run, u, action):
    q = np.array([[1.0, 2.0, -np.inf, 0.0]])
    assert as_run(softmax_action)(0, -1, u, 0.5, q) == action


# The same without RIGHT: e^0, e^-2 of (1, 0): shares end at 0.8807971 and 1.
@pytest.mark.parametrize('u, action', [(0.88, LEFT), (0.8808, UP)])
def test_softmax_without_the_excluded_action(as_run, u, action):
    q = np.array([[1.0, 2.0, -np.inf, 0.0]])
    assert as_run(softmax_action)(0, RIGHT, u, 0.5, q) == action


def test_a_cold_softmax_is_greedy(as_run):
    q = np.array([[1.0, 1.001, -np.inf, 0.0]])
    for u in (0.0, 0.5, 0.9999999999999999):
        assert as_run(softmax_action)(0, -1, u, 1e-9, q) == RIGHT


def test_in_a_dead_end_the_excluded_action_is_all_there_is(as_run):
    assert as_run(softmax_action)(0, RIGHT, 0.5, 1.0, Bench(corridor()).memory.q) == RIGHT


@pytest.mark.parametrize('weights, index', [
    ((1.0, 1.0, 1.0, 1.0), 3), ((1.0, 1.0, 1.0, 0.0), 2), ((1.0, 1.0, 0.0, 0.0), 1),
    ((1.0, 0.0, 0.0, 0.0), 0)])
def test_rounding_never_draws_what_has_no_weight(as_run, weights, index):
    assert as_run(drawn)(1.0, *weights) == index


# (3.2), (3.7): the advice with probability p, else the own choice
@pytest.mark.parametrize('u_listen, excludes, action', [
    (0.8999, False, DOWN), (0.9, False, DOWN), (0.9, True, LEFT)])
def test_the_advice_is_followed_with_probability_p(as_run, u_listen, excludes, action):
    bench = Bench(room(), trust='scheduled', confidence=0.9, excludes_refused=excludes,
                  temperature=1e-9)
    bench.memory.q[4] = [1.0, 0.0, 2.0, 0.5]
    assert as_run(choose)(
        4, DOWN, 0, u_listen, 0.5, bench.numbers, *bench.arrays) == (action, 0.9)


@pytest.mark.parametrize('settings, advice', [
    ({'trust': 'scheduled', 'excludes_refused': True}, -1), ({'trust': 'none'}, LEFT)])
def test_without_advice_or_trust_the_choice_is_its_own(as_run, settings, advice):
    bench = Bench(room(), temperature=1e-9, **settings)
    bench.memory.q[4] = [1.0, 0.0, 2.0, 0.5]
    assert as_run(choose)(4, advice, 0, 0.0, 0.5, bench.numbers, *bench.arrays) == (DOWN, 0.0)


def test_an_iteration_cools(as_run):  # (2.25), (3.6)
    bench = Bench(room(), temperature=0.5, temperature_factor=0.98, confidence=0.9,
                  confidence_factor=0.99)
    as_run(decay_schedules)(0.0, bench.numbers, bench.memory.schedule)
    assert bench.memory.schedule[CONFIDENCE] == pytest.approx(0.891)
    assert bench.memory.schedule[TEMPERATURE] == pytest.approx(0.49)


def test_the_temperature_has_a_floor_and_may_wait_for_the_confidence(as_run):
    bench = Bench(room(), temperature=0.5, temperature_factor=0.5, temperature_floor=0.3,
                  confidence=0.9, confidence_factor=0.7, cooling_confidence=0.5)
    seen = []
    for _ in range(3):  # confidence 0.63, 0.441, 0.3087
        as_run(decay_schedules)(0.0, bench.numbers, bench.memory.schedule)
        seen.append(bench.memory.schedule[TEMPERATURE])
    assert seen == [0.5, 0.3, 0.3]


def test_the_temperature_falls_as_soon_as_the_confidence_is_low_enough(as_run):
    bench = Bench(room(), temperature=0.5, temperature_factor=0.5, confidence=1.0,
                  confidence_factor=0.5, cooling_confidence=0.5)
    as_run(decay_schedules)(0.0, bench.numbers, bench.memory.schedule)
    assert bench.memory.schedule[:2].tolist() == [0.5, 0.25]


def test_an_iteration_lowers_the_trust_rate(as_run):
    bench = Bench(room(), trust_rate=2.0, trust_rate_factor=0.99)
    as_run(decay_schedules)(0.0, bench.numbers, bench.memory.schedule)
    assert bench.memory.schedule[TRUST_RATE] == pytest.approx(1.98)


def test_a_jump_start_gets_shorter_when_the_return_is_near_the_best(as_run):
    bench, stages = Bench(room(), guided_tolerance=0.1), []
    for mean_return in (-10.0, -10.9, -11.1, -5.0, -5.6):  # bounds: none, -11, -11, -11, -5.5
        as_run(decay_schedules)(mean_return, bench.numbers, bench.memory.schedule)
        stages.append(bench.memory.schedule[STAGE])
    assert stages == [1.0, 2.0, 2.0, 3.0, 3.0]
    assert bench.memory.schedule[BEST_RETURN] == -5.0


def test_an_error_reaches_the_steps_before(as_run):  # the pseudo-code of Sarsa(lambda)
    # Three steps 3 -> 4 -> 5 of one episode: q 0, rate 0.5, gamma 0.9, lambda 0.5, r = -1.
    bench = Bench(room(), trace_decay=0.5, **HALF)
    for s, s2 in ((3, 4), (4, 5)):
        as_run(learn)(s, RIGHT, -1.0, s2, UP, False, -1, bench.numbers, *bench.arrays)
    # the second error of -1 reaches 3 with the trace 0.9 * 0.5: -0.5 - 0.5 * 0.45
    assert bench.memory.q[[3, 4], RIGHT].tolist() == pytest.approx([-0.725, -0.5])
    assert bench.memory.traces[[3, 4], RIGHT].tolist() == pytest.approx([0.2025, 0.45])


def watkins(as_run, a2, **settings):
    """Return the traces after a step from 4 to the right, before action a2, q[5] as in `step`."""
    bench = Bench(room(), trace_decay=0.5, off_policy=True, **settings, **HALF)
    bench.memory.q[5] = [1.0, -np.inf, 6.0, 4.0]
    as_run(learn)(4, RIGHT, -1.0, 5, a2, False, -1, bench.numbers, *bench.arrays)
    assert bench.memory.q[4, RIGHT] == pytest.approx(0.5 * (-1.0 + 0.9 * 6.0))  # (2.17)
    return bench.memory.traces.sum()


def test_watkins_cuts_the_traces_before_an_action_that_is_not_greedy(as_run):
    assert watkins(as_run, DOWN) == pytest.approx(0.45)
    assert watkins(as_run, UP) == 0.0
    assert watkins(as_run, UP, cuts_traces=False) == pytest.approx(0.45)


def test_on_policy_no_trace_is_cut(as_run):
    bench = Bench(room(), trace_decay=0.5, **HALF)
    assert step(as_run, bench).traces[4, RIGHT] == pytest.approx(0.45)
