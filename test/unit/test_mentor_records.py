# SPDX-License-Identifier: Apache-2.0
"""The record of a mentor of a learner with a model, and what follows from it, by hand."""

import math

import pytest
from tiny_worlds import advised, Bench, room, see

from comply_ros.learner.action_choice import choose
from comply_ros.learner.learner_state import ALTERNATIVES, SCALE, TERMINAL
from comply_ros.learner.mentor_records import count_fruitless_episode, hear_advice
from comply_ros.learner.model_exploration import exploration_chances
from comply_ros.learner.prior_values import credence, doubt_of, outcome_spread
from comply_ros.world.grid import DOWN, LEFT, RIGHT, UP


def mentored(agreed=1.0, seen=1.0, **settings):
    """Return a bench where 10 was earned, p is 0.5, and of advice some proved good."""
    bench = Bench(room(), learns_model=True, trust='track_record', **settings)
    bench.state.pooled[...] = [1.0, 3.0, 10.0, 10.0, 79.0]  # p = (1 + 1) / (3 + 1)
    bench.state.advice_agreed[0], bench.state.advice_seen[0] = agreed, seen
    return bench


def tried(bench, *values, s=4):
    """All actions of the state were tried three times, and have these values."""
    bench.state.visits[s], bench.state.q[s] = 4.0, values


def hear(as_run, bench, advice, s=4):
    """Hear advice in a state, and return the record: how often it was good, of how many times."""
    as_run(hear_advice)(s, advised(advice), bench.kernel_config, bench.state)
    return bench.state.advice_agreed[0], bench.state.advice_seen[0]


@pytest.mark.parametrize('agreed, credit', [(8.0, 1.0), (6.0, 0.25), (4.0, 0.0), (1.0, 0.0)])
def test_the_credit_of_a_mentor_falls_to_0_at_one_half(as_run, agreed, credit):
    assert as_run(credence)(0, mentored(agreed, 8.0).state) == pytest.approx(credit)


def test_a_mentor_that_was_never_wrong_is_in_doubt_the_less_the_more_was_tried(as_run):
    # u is 0.03, and 0.8 more where outcomes are as random as can be.
    bench = mentored()
    for tried_beside in (0.0, 0.6, 63.0):
        bench.state.pooled[ALTERNATIVES] = tried_beside
        doubt = as_run(doubt_of)(0, bench.state)
        assert doubt == pytest.approx(0.83 / (0.83 + 1.0 + tried_beside))
    bench.state.pooled[:2], bench.state.pooled[ALTERNATIVES] = 3.0, 3.0  # p is 1
    assert as_run(doubt_of)(0, bench.state) == pytest.approx(0.03 / 4.03)


def test_a_mentor_that_was_wrong_is_in_doubt_as_often_as_it_was(as_run):
    assert as_run(doubt_of)(0, mentored(6.0, 8.0).state) == pytest.approx(0.25)


def test_outcomes_are_most_random_where_half_of_them_are_usual(as_run):
    bench = mentored()
    assert as_run(outcome_spread)(bench.state.pooled) == 1.0
    bench.state.pooled[:2] = 3.0, 4.0  # 2 sqrt(0.8 * 0.2)
    assert as_run(outcome_spread)(bench.state.pooled) == pytest.approx(0.8)


def test_advice_counts_once_it_was_tried_and_another_action_too(as_run):
    bench = mentored()
    assert hear(as_run, bench, LEFT) == (1.0, 1.0)  # nothing was tried
    bench.state.visits[4, LEFT], bench.state.q[4, LEFT] = 2.0, 1.0
    assert hear(as_run, bench, LEFT) == (1.0, 1.0)  # it alone
    tried(bench, 1.0, 3.0, 0.0, 0.0)
    assert hear(as_run, bench, RIGHT) == (2.0, 2.0)
    assert hear(as_run, bench, -1) == (2.0, 2.0)
    assert bench.state.advised[4] == RIGHT  # the newest one is remembered


def test_each_state_counts_once_by_the_newest_verdict(as_run):
    bench = mentored()
    tried(bench, 1.0, 3.0, 0.0, 0.0)
    assert [hear(as_run, bench, a) for a in (RIGHT, RIGHT, LEFT)] == [
        (2.0, 2.0), (2.0, 2.0), (1.0, 2.0)]
    tried(bench, 3.0, 1.0, 0.0, 0.0)  # later it is found to be better
    assert hear(as_run, bench, LEFT) == (2.0, 2.0)
    bench.state.visits[4, LEFT] = 1.0
    assert hear(as_run, bench, LEFT) == (1.0, 1.0)  # not known any more
    tried(bench, 1.0, 3.0, 0.0, 0.0, s=7)
    assert hear(as_run, bench, RIGHT, s=7) == (2.0, 2.0)


def test_before_any_reward_an_episode_speaks_against_who_advised_in_it(as_run):
    bench = mentored()
    bench.state.pooled[SCALE] = 0.0
    tried(bench, 0.0, 0.003, 0.0, 0.0)  # by the cost of time alone
    assert hear(as_run, bench, LEFT) == (1.0, 1.0)
    for states, seen in (((), 1.0), ((3, 7), 1.0), ((4, 7), 2.0), ((3, 4), 3.0)):
        bench.state.trail[:1 + len(states)] = len(states), *(4 * s + RIGHT for s in states)
        as_run(count_fruitless_episode)(bench.kernel_config, bench.state)
        assert bench.state.advice_seen[0] == seen
    bench.state.pooled[SCALE] = 10.0
    as_run(count_fruitless_episode)(bench.kernel_config, bench.state)
    assert bench.state.advice_seen[0] == 3.0


def test_how_much_a_value_changes_is_a_mean_that_forgets_half_at_each_visit(as_run):
    bench = mentored()
    for departures, value, change in ((1.0, 5.0, 0.0), (2.0, 3.0, 1.0), (3.0, 4.0, 1.0),
                                      (4.0, 4.0, 0.5)):
        bench.state.departures[4], bench.state.values[4] = departures, value
        hear(as_run, bench, -1)
        assert bench.state.value_changes[4].tolist() == [value, change]


def test_advice_that_is_hardly_worse_is_good_the_more_so_from_a_mentor_with_credit(as_run):
    bench = mentored(1.0, 2.0)  # no credit: 0.002 * 10 is 0.02
    tried(bench, 0.981, 1.0, 0.979, 0.0)
    assert hear(as_run, bench, LEFT) == (2.0, 3.0)
    bench = mentored(1.0, 1.0)  # credit 1: four times that
    tried(bench, 0.921, 1.0, 0.919, 0.0)
    assert hear(as_run, bench, LEFT) == (2.0, 2.0)


@pytest.mark.parametrize('agreed, samples, counts', [
    (10.0, 1, False), (10.0, 20, True),  # of a trusted mentor, only where it is no chance
    (8.5, 1, False), (7.5, 1, True)])    # of another one, where it is more likely wrong
def test_advice_that_is_worse_counts_where_it_is_more_likely_wrong(
        as_run, agreed, samples, counts):
    # Values of 1 and 2, all samples alike; one of the squared distance 1.44 is supposed beside
    # them, and 1 more of the prior. With one sample of each action the variance is 1.44, e is
    # sqrt(2 * 1.44 / 2) = 1.2, and the chance 1 / (1 + exp(1.7 / 1.2)) = 0.195: rho / (1 - rho)
    # must be 4.1. With 20 samples it is 2 (1.44 / 9) / 21, sqrt(2 * 0.0152 / 21) = 0.038, and
    # beyond all chance.
    bench = mentored(agreed, 10.0, slip_prior=1.0)
    see(bench, LEFT, (samples, TERMINAL, 1.0))
    see(bench, RIGHT, (samples, TERMINAL, 2.0))
    bench.state.q[4] = [1.0, 2.0, 0.0, 0.0]
    assert hear(as_run, bench, LEFT) == (agreed, 11.0 if counts else 10.0)


def test_advice_that_leads_round_in_circles_counts_against_the_mentor(as_run):
    bench = mentored()
    bench.state.traces[4, 0] = 16.0  # 4 + 24 * 0.5
    assert hear(as_run, bench, LEFT) == (1.0, 1.0)
    bench.state.traces[4, 0] = 17.0
    assert hear(as_run, bench, LEFT) == (1.0, 2.0)
    bench.state.pooled[:2], bench.state.traces[7, 0] = 3.0, 5.0  # p is 1: nothing slips
    assert hear(as_run, bench, LEFT, s=7) == (1.0, 3.0)


def test_untried_actions_have_a_share_of_the_largest_reward_and_the_advised_one_more(as_run):
    bench = mentored(8.0, 8.0)  # credit 1: 0.3 * 10, and 0.03 * 10 more
    hear(as_run, bench, UP)
    assert bench.state.q[4].tolist() == pytest.approx([3.0, 3.0, 3.0, 3.3])
    bench = mentored(2.0, 8.0)  # no credit: 6.5, and 0.3 * (2 * 0.25 - 1)
    hear(as_run, bench, UP)
    assert bench.state.q[4].tolist() == pytest.approx([6.5, 6.5, 6.5, 6.35])


def test_other_actions_are_worth_no_more_than_tried_advice_of_a_mentor_with_credit(as_run):
    bench = mentored(6.0, 8.0)  # credit 0.25: 6.5 - 0.25 * 3.5 = 5.625; 3/4 of that and 1/4 of 1
    bench.state.visits[4, UP], bench.state.q[4, UP] = 2.0, 1.0
    hear(as_run, bench, UP)
    assert bench.state.q[4].tolist() == pytest.approx(3 * [0.75 * 5.625 + 0.25] + [1.0])


def test_without_advice_untried_actions_are_explored_and_with_it_as_far_as_it_is_in_doubt(as_run):
    bench = mentored(6.0, 8.0)  # doubt 1 - 6 / 8
    bench.state.q[4] = [0.0, 1.0, 0.0, 0.0]
    explores = [as_run(exploration_chances)(4, advised(a), bench.kernel_config, bench.state)[0]
                for a in (-1, LEFT, RIGHT)]
    assert explores == pytest.approx([0.4, 0.4, 0.1])
    bench.state.potential[4] = [0.2, 0.0, 0.4, 0.0]
    doubtful = [as_run(exploration_chances)(4, advised(a), bench.kernel_config, bench.state)[1]
                for a in (-1, LEFT, RIGHT)]
    assert doubtful == pytest.approx([0.6, 0.6, 0.15])


@pytest.mark.parametrize('advice, u_listen, u_act, action', [
    (RIGHT, 0.76, 0.0, RIGHT),  # follows below 0.9 * 0.85 = 0.765
    (RIGHT, 0.77, 0.3, LEFT),   # tries what is in doubt: left with 1/3, down with 2/3
    (RIGHT, 0.77, 0.4, DOWN),
    (RIGHT, 0.91, 0.99, UP),    # tries what is new
    (LEFT, 0.1, 0.0, RIGHT),    # does not follow: the best action below 0.6 * 0.4 = 0.24
    (LEFT, 0.25, 0.3, LEFT),
    (-1, 0.61, 0.0, UP)])
def test_a_choice_follows_or_tries_what_is_in_doubt_or_new_or_is_the_best(
        as_run, advice, u_listen, u_act, action):
    bench = mentored(6.0, 8.0)
    tried(bench, 0.0, 1.0, 0.0, 0.0)
    bench.state.visits[4, UP] = 1.0
    bench.state.potential[4] = [0.2, 0.0, 0.4, 0.0]
    chosen, p, _ = as_run(choose)(
        4, advised(advice), 0, u_listen, u_act, bench.kernel_config, bench.state)
    assert chosen == action
    assert p == pytest.approx(0.765 if advice == RIGHT else 0.0)


def test_the_untried_advice_of_a_mentor_that_is_mostly_wrong_is_left_out(as_run):
    bench = mentored(2.0, 8.0)
    bench.state.q[4] = [0.0, 1.0, 0.0, 0.0]
    bench.state.visits[4, [RIGHT, DOWN]] = 4.0  # left and up are new
    for u_act in (0.0, 0.99):
        chosen, *_ = as_run(choose)(
            4, advised(LEFT), 0, 0.99, u_act, bench.kernel_config, bench.state)
        assert chosen == UP


def test_equally_good_actions_are_equally_likely_with_a_model(as_run):
    bench = mentored()
    tried(bench, 2.0, 2.0, 1.0, 2.0)
    chosen = [as_run(choose)(4, advised(-1), 0, 0.5, u, bench.kernel_config, bench.state)[0]
              for u in (0.0, 0.34, math.nextafter(1.0, 0.0))]
    assert chosen == [LEFT, RIGHT, UP]
