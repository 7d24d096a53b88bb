# SPDX-License-Identifier: Apache-2.0
"""Advice as a head start, pooled trust, and a prior that is learned from the other states."""

import numpy as np
import pytest
from tiny_worlds import Bench, room

from comply_ros.learner.belief_update import pooled_belief, update_belief
from comply_ros.learner.confidence import apply_advice_prior, exploration_probability
from comply_ros.learner.learner_state import (
    AGREED,
    LISTEN,
    MET,
    POOLED,
    POOLED_DISCARD,
    POOLED_LISTEN,
)
from comply_ros.learner.update_rules import choose
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP


def head_start(**settings):
    """Return a bench whose advice begins 0.5 above the others, which begin at 3."""
    return Bench(room(), trust='head_start', belief_listen=0.5, belief_discard=0.0,
                 initial_value=3.0, **settings)


def hear(as_run, bench, advice, s=4):
    """Heed the advice in a state."""
    memory = bench.memory
    as_run(apply_advice_prior)(s, advice, bench.numbers, memory.q, memory.visits, memory.belief,
                 memory.schedule)


def test_advice_begins_above_the_other_actions_once(as_run):
    bench = head_start()
    for _ in range(3):
        hear(as_run, bench, UP)
    assert bench.memory.q[4].tolist() == [3.0, 3.0, 3.0, 3.5]


def test_advice_that_was_tried_before_it_came_gets_no_head_start(as_run):
    bench = head_start()
    bench.memory.visits[4, UP] = 2.0
    hear(as_run, bench, UP)
    assert bench.memory.q[4].tolist() == [3.0] * 4


def test_it_is_counted_how_often_the_advice_is_the_best_action(as_run):
    bench = head_start(exploration_probability=0.2)
    hear(as_run, bench, UP)
    bench.memory.q[4, UP] = -1.0  # experience has taken it back
    hear(as_run, bench, UP)
    hear(as_run, bench, -1)
    assert (bench.memory.schedule[AGREED], bench.memory.schedule[MET]) == (2.0, 3.0)
    # doubt is 1 - 2/3; without advice it is whole
    assert as_run(exploration_probability)(UP, bench.numbers, bench.memory.schedule) == pytest.approx(0.2 / 3)
    assert as_run(exploration_probability)(-1, bench.numbers, bench.memory.schedule) == 0.2


def test_the_best_action_is_followed_but_for_curiosity(as_run):
    bench = head_start(exploration_probability=0.2)
    bench.memory.q[4] = [1.0, 2.0, 3.0, 0.0]
    bench.memory.schedule[[AGREED, MET]] = 1.0, 4.0
    assert bench.confidence(as_run, advice=DOWN) == pytest.approx(1.0 - 0.2 * 0.75)
    assert bench.confidence(as_run, advice=LEFT) == 0.0
    bench.memory.visits[4] = 2.0  # nothing is left to be tried
    assert bench.confidence(as_run, advice=DOWN) == 1.0


@pytest.mark.parametrize('advice, u_listen, u_act, action', [
    (DOWN, 0.849, 0.9, DOWN),   # follows: p is 0.85
    (DOWN, 0.851, 0.0, LEFT),   # tries what was never tried: left or up
    (DOWN, 0.851, 0.99, UP),
    (LEFT, 0.0, 0.0, DOWN),     # refuses; its own best
    (LEFT, 0.851, 0.99, UP),
    (-1, 0.79, 0.0, DOWN),      # no advice: curiosity is 0.2
    (-1, 0.81, 0.0, LEFT)])
def test_a_choice_follows_tries_or_takes_the_best(as_run, advice, u_listen, u_act, action):
    bench = head_start(exploration_probability=0.2)
    bench.memory.q[4] = [1.0, 2.0, 3.0, 0.0]
    bench.memory.visits[4, [RIGHT, DOWN]] = 2.0
    bench.memory.schedule[[AGREED, MET]] = 1.0, 4.0
    chosen, _ = as_run(choose)(4, advice, 0, u_listen, u_act, bench.numbers, *bench.arrays)
    assert chosen == action


@pytest.mark.parametrize('u, action', [(0.0, LEFT), (0.49, LEFT), (0.5, UP), (0.99, UP)])
def test_equally_good_actions_are_equally_likely(as_run, u, action):
    bench = head_start()
    bench.memory.q[4] = [3.0, 2.0, 1.0, 3.0]
    assert as_run(choose)(4, -1, 0, 0.0, u, bench.numbers, *bench.arrays)[0] == action


def update(as_run, bench, s, a, delta):
    """Change the belief by the first step out of a state, in which RIGHT was advised."""
    memory = bench.memory
    as_run(update_belief)(s, a, RIGHT, delta, bench.numbers, memory.q, memory.belief,
                          memory.schedule)


def test_a_learned_prior_is_the_mean_of_the_states_left(as_run):
    # Prior (8, 2). Two states end with (8 - 2 * 0.2 * 10, 2) = (4, 2): the sums are 16 and 6, so
    # the mean is 16 / 22, and it is as sure as the prior: 10 in all.
    bench = Bench(room(), trust='beta', trust_rate=2.0, learns_prior=True)
    for s in (0, 1):
        update(as_run, bench, s, RIGHT, -10.0)
    schedule = bench.memory.schedule
    assert schedule[[POOLED, POOLED_LISTEN, POOLED_DISCARD]].tolist() == [3.0, 16.0, 6.0]
    hear(as_run, bench, RIGHT)
    assert bench.memory.belief[4, :2].tolist() == pytest.approx([10 * 16 / 22, 10 * 6 / 22])
    assert bench.memory.belief[3, :2].tolist() == [8.0, 2.0]


def test_a_state_that_was_left_keeps_its_own_belief(as_run):
    bench = Bench(room(), trust='beta', trust_rate=2.0, learns_prior=True)
    update(as_run, bench, 0, RIGHT, -10.0)
    hear(as_run, bench, RIGHT, s=0)
    assert bench.memory.belief[0, :2].tolist() == [4.0, 2.0]


def test_a_learned_beginning_of_explicit_values(as_run):  # (3.13): the mean of both values
    bench = Bench(room(), trust='explicit', trust_rate=0.5, learns_prior=True, belief_listen=1.0,
                  belief_discard=0.0)
    bench.memory.q[0] = [-np.inf, 5.0, -np.inf, 3.0]
    update(as_run, bench, 0, RIGHT, 0.0)  # listening 0.5 * 1 + 0.5 * 5, discarding 0.5 * 3
    numbers, schedule = bench.numbers, bench.memory.schedule
    assert as_run(pooled_belief)(numbers, schedule) == ((1.0 + 3.0) / 2, 1.5 / 2)


def test_without_a_learned_prior_the_belief_begins_as_it_is_set(as_run):
    bench = Bench(room(), trust='beta', trust_rate=2.0)
    update(as_run, bench, 0, RIGHT, -10.0)
    hear(as_run, bench, RIGHT)
    assert bench.memory.belief[4, LISTEN] == 8.0
