# SPDX-License-Identifier: Apache-2.0
"""Advice as a head start, pooled trust, and a prior that is learned from the other states."""

import numpy as np
import pytest
from tiny_worlds import advised, Bench, room

from comply_ros.learner.action_choice import choose
from comply_ros.learner.belief_update import pooled_belief
from comply_ros.learner.confidence import apply_advice_prior, exploration_probability
from comply_ros.learner.learner_state import LISTEN
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP


def head_start(**settings):
    """Return a bench where advice adds 0.5 to a first action value of 3."""
    return Bench(room(), trust='head_start', belief_listen=0.5, belief_discard=0.0,
                 initial_value=3.0, **settings)


def advise(as_run, bench, advice, s=4):
    """Apply the prior of advice in a state."""
    as_run(apply_advice_prior)(s, advised(advice), bench.kernel_config, bench.state)


def test_an_advised_action_starts_above_the_others_once(as_run):
    bench = head_start()
    for _ in range(3):
        advise(as_run, bench, UP)
    assert bench.state.q[4].tolist() == [3.0, 3.0, 3.0, 3.5]


def test_an_action_that_was_tried_before_its_advice_came_gets_no_head_start(as_run):
    bench = head_start()
    bench.state.visits[4, UP] = 2.0
    advise(as_run, bench, UP)
    assert bench.state.q[4].tolist() == [3.0] * 4


def test_the_state_counts_how_often_the_advice_is_the_best_action(as_run):
    bench = head_start(exploration_probability=0.2)
    advise(as_run, bench, UP)
    bench.state.q[4, UP] = -1.0  # experience has put it below the others
    advise(as_run, bench, UP)
    advise(as_run, bench, -1)
    assert (bench.state.advice_agreed[0], bench.state.advice_seen[0]) == (2.0, 3.0)
    # 0.2 times the share of other advice, 1 - 2/3; without advice 0.2
    explores = as_run(exploration_probability)
    assert explores(advised(UP), bench.kernel_config, bench.state) == pytest.approx(0.2 / 3)
    assert explores(advised(-1), bench.kernel_config, bench.state) == 0.2


def test_the_best_action_is_followed_unless_another_is_explored(as_run):
    bench = head_start(exploration_probability=0.2)
    bench.state.q[4] = [1.0, 2.0, 3.0, 0.0]
    bench.state.advice_agreed[0], bench.state.advice_seen[0] = 1.0, 4.0
    assert bench.confidence(as_run, advice=DOWN) == pytest.approx(1.0 - 0.2 * 0.75)
    assert bench.confidence(as_run, advice=LEFT) == 0.0
    bench.state.visits[4] = 2.0  # every action was tried
    assert bench.confidence(as_run, advice=DOWN) == 1.0


@pytest.mark.parametrize('advice, u_listen, u_act, action', [
    (DOWN, 0.849, 0.9, DOWN),   # follows: p is 0.85
    (DOWN, 0.851, 0.0, LEFT),   # explores what was never tried: left or up
    (DOWN, 0.851, 0.99, UP),
    (LEFT, 0.0, 0.0, DOWN),     # does not follow: takes its own best action
    (LEFT, 0.851, 0.99, UP),
    (-1, 0.79, 0.0, DOWN),      # no advice: explores with probability 0.2
    (-1, 0.81, 0.0, LEFT)])
def test_a_choice_follows_explores_or_takes_the_best_action(
        as_run, advice, u_listen, u_act, action):
    bench = head_start(exploration_probability=0.2)
    bench.state.q[4] = [1.0, 2.0, 3.0, 0.0]
    bench.state.visits[4, [RIGHT, DOWN]] = 2.0
    bench.state.advice_agreed[0], bench.state.advice_seen[0] = 1.0, 4.0
    chosen, *_ = as_run(choose)(
        4, advised(advice), 0, u_listen, u_act, bench.kernel_config, bench.state)
    assert chosen == action


@pytest.mark.parametrize('u, action', [(0.0, LEFT), (0.49, LEFT), (0.5, UP), (0.99, UP)])
def test_equally_good_actions_are_equally_likely(as_run, u, action):
    bench = head_start()
    bench.state.q[4] = [3.0, 2.0, 1.0, 3.0]
    chosen, *_ = as_run(choose)(4, advised(-1), 0, 0.0, u, bench.kernel_config, bench.state)
    assert chosen == action


def test_a_learned_prior_is_the_mean_of_the_states_left(as_run):
    # Prior (8, 2). Two states end with (8 - 2 * 0.2 * 10, 2) = (4, 2): the sums are 16 and 6, so
    # the mean is 16 / 22, and it is as strong as the prior: 10 in all.
    bench = Bench(room(), trust='beta', trust_rate=2.0, learns_prior=True)
    for s in (0, 1):
        bench.update_belief(as_run, RIGHT, -10.0, s)
    state = bench.state
    assert (state.pool_size[0], state.pool_listen[0], state.pool_discard[0]) == (3.0, 16.0, 6.0)
    advise(as_run, bench, RIGHT)
    assert state.belief[4, :2].tolist() == pytest.approx([10 * 16 / 22, 10 * 6 / 22])
    assert state.belief[3, :2].tolist() == [8.0, 2.0]


def test_a_state_that_was_left_keeps_its_own_belief(as_run):
    bench = Bench(room(), trust='beta', trust_rate=2.0, learns_prior=True)
    bench.update_belief(as_run, RIGHT, -10.0, 0)
    advise(as_run, bench, RIGHT, s=0)
    assert bench.state.belief[0, :2].tolist() == [4.0, 2.0]


def test_a_learned_prior_of_explicit_values_is_the_mean_of_both(as_run):  # (3.13)
    bench = Bench(room(), trust='explicit', trust_rate=0.5, learns_prior=True, belief_listen=1.0,
                  belief_discard=0.0)
    bench.state.q[0] = [-np.inf, 5.0, -np.inf, 3.0]
    # listening 0.5 * 1 + 0.5 * 5, discarding 0.5 * 3
    bench.update_belief(as_run, RIGHT, 0.0, 0)
    assert as_run(pooled_belief)(0, bench.kernel_config, bench.state) == ((1.0 + 3.0) / 2, 1.5 / 2)


def test_without_a_learned_prior_the_first_belief_is_that_of_the_settings(as_run):
    bench = Bench(room(), trust='beta', trust_rate=2.0)
    bench.update_belief(as_run, RIGHT, -10.0, 0)
    advise(as_run, bench, RIGHT)
    assert bench.state.belief[4, LISTEN] == 8.0
