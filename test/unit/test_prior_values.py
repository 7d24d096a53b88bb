# SPDX-License-Identifier: Apache-2.0
"""What several mentors say together, by hand (docs/methods/model_based.md)."""

import numpy as np
import pytest
from tiny_worlds import room

from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.learner_state import ALTERNATIVES, initial_state
from comply_ros.learner.model_exploration import exploration_chances
from comply_ros.learner.prior_values import credit, expected_untried_value, share_of_advice
from comply_ros.world.grid import LEFT, RIGHT, UP

CENTRE = 4  # a state with all four moves


def mentored(*records):
    """Return settings and state of a learner whose mentors have these records, as kernels do."""
    world, config = room(), LearnerConfig(learns_model=True, trust='track_record')
    state = initial_state(world, config, len(records))
    state.pooled[:4] = [1.0, 3.0, 10.0, 10.0]  # p is 1/2, and 10 was earned
    state.advice_seen[...] = 10.0
    state.advice_agreed[...] = 10.0 * np.array(records)
    return config.for_kernels(world.n_actions, len(records)), state


def advised(state, *advice):
    """Change the newest advice of each mentor in the centre; return it, as kernels take it."""
    states = len(state.departures)
    for m, action in enumerate(advice):
        state.advised[m * states + CENTRE] = action
    return np.array(advice)


def test_two_mediocre_mentors_that_agree_are_believed():
    config, state = mentored(0.6, 0.6, 0.3)
    advised(state, RIGHT, RIGHT, UP)
    assert share_of_advice(CENTRE, RIGHT, config, state) == pytest.approx(0.084 / 0.0976296)
    assert credit(CENTRE, 0, RIGHT, config, state) == pytest.approx(0.5195, abs=1e-4)
    # w(up) / sum = 0.00533 / 0.09763, and the record of the third mentor is below one half.
    assert share_of_advice(CENTRE, UP, config, state) == pytest.approx(0.0533333 / 0.976296)
    assert credit(CENTRE, 2, UP, config, state) == 0.0


def test_with_one_mentor_the_share_of_its_advice_is_its_record():
    config, state = mentored(0.7)
    advised(state, RIGHT)
    assert share_of_advice(CENTRE, RIGHT, config, state) == pytest.approx(0.7)
    assert share_of_advice(CENTRE, LEFT, config, state) == pytest.approx(0.1)
    assert credit(CENTRE, 0, RIGHT, config, state) == pytest.approx(0.4 ** 2)


def test_a_mentor_without_advice_in_a_state_says_nothing_there():
    config, state = mentored(0.7, 0.9)
    advised(state, RIGHT, -1)
    assert share_of_advice(CENTRE, RIGHT, config, state) == pytest.approx(0.7)


def test_two_mentors_that_were_always_right_and_disagree_are_equally_likely():
    config, state = mentored(1.0, 1.0)
    advised(state, RIGHT, UP)
    share = share_of_advice(CENTRE, RIGHT, config, state)
    assert share == share_of_advice(CENTRE, UP, config, state)
    assert 0.49 < share < 0.5  # the rest is left for the other two


def test_a_good_mentor_keeps_its_credit_where_bad_ones_agree_on_another_action():
    config, state = mentored(0.9, 0.4, 0.4)
    advised(state, RIGHT, UP, UP)
    assert credit(CENTRE, 0, RIGHT, config, state) == pytest.approx(0.8 ** 2)


def test_where_mentors_agree_less_is_explored():
    config, state = mentored(0.6, 0.6)
    state.pooled[ALTERNATIVES] = 10.0  # nothing is doubted more than its record says
    state.visits[CENTRE, RIGHT], state.q[CENTRE] = 2.0, 0.0
    alone = exploration_chances(CENTRE, advised(state, RIGHT, -1), config, state)[0]
    together = exploration_chances(CENTRE, advised(state, RIGHT, RIGHT), config, state)[0]
    assert alone == pytest.approx(0.4 * (1 - 0.6))  # 1 - P
    # P(right) = 0.36 / (0.36 + 3 (0.4 / 3)^2) = 0.871; the product of the doubts is above 1 - P.
    assert together == pytest.approx(0.4 * (1 - 0.36 / (0.36 + 3 * (0.4 / 3) ** 2)))


def test_an_action_that_several_advise_is_expected_to_be_worth_more():
    config, state = mentored(0.8, 0.9)
    advised(state, RIGHT, RIGHT)
    both = expected_untried_value(CENTRE, RIGHT, False, config, state)
    other = expected_untried_value(CENTRE, LEFT, False, config, state)
    # 0.03 of the largest reward times (2 x 0.8 - 1) + (2 x 0.9 - 1)
    assert both - other == pytest.approx(0.03 * 10.0 * 1.4)


def test_a_state_off_the_path_of_a_mentor_is_not_expected_to_be_much_better(as_run):
    config, state = mentored(0.9)  # confidence 2 x 0.9 - 1 = 0.8, credit 0.64
    advised(state, RIGHT)
    alone = expected_untried_value(CENTRE, LEFT, True, config, state)
    assert alone == expected_untried_value(CENTRE, LEFT, False, config, state)
    # State 3 led here first; the mentor advised UP there, which was tried and is worth 2.
    state.predecessors[CENTRE, :2] = 1, 3
    state.advised[3], state.visits[3, UP], state.q[3, UP] = UP, 2.0, 2.0
    nearby = as_run(expected_untried_value)(CENTRE, LEFT, False, config, state)
    assert nearby == pytest.approx(alone - 0.7 * 0.8 * (alone - 2.0))
    assert expected_untried_value(CENTRE, LEFT, True, config, state) == alone
    state.q[3, UP] = 9.0  # what is better there is no reason to expect more here
    assert expected_untried_value(CENTRE, LEFT, False, config, state) == alone
    state.visits[3, UP] = 1.0  # and nothing is known there before it was tried
    assert expected_untried_value(CENTRE, LEFT, False, config, state) == alone
