# SPDX-License-Identifier: Apache-2.0
"""A mentor with a budget."""

import numpy as np
import pytest
from tiny_tables import hall, machine
from tiny_worlds import corridor, grid, room

from comply_ros.mentor.advice_budget import AdviceBudget, importance, validate_advice_budget
from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.world.grid import LEFT, RIGHT, UP
from comply_ros.world.mdp import World
from comply_ros.world.state_action_spaces import Spaces

RIGHTS = [RIGHT] * 9


def advice(mentor, *states):
    """Return what the mentor advises in each of the states."""
    return [mentor.advise(s) for s in states]


def test_without_a_limit_the_mentor_advises_everywhere():
    assert advice(AdviceBudget(room(), RIGHTS), 0, 3, 0, 1) == [RIGHT] * 4
    assert advice(AdviceBudget(room(), [-1] * 9), 0, 3) == [-1, -1]


def test_an_early_mentor_advises_in_the_first_states_and_repeats_itself_freely():
    mentor = AdviceBudget(room(), RIGHTS, budget=2)
    assert advice(mentor, 0, 0, 3, 1, 0, 3, 1) == [RIGHT, RIGHT, RIGHT, -1, RIGHT, RIGHT, -1]


def test_no_advice_costs_nothing():
    mentor = AdviceBudget(room(), [-1, RIGHT] + [-1] * 7, budget=1)
    assert advice(mentor, 0, 0, 1, 1) == [-1, -1, RIGHT, RIGHT]


def test_a_mentor_advises_where_the_learner_took_another_action_the_last_time():
    mentor = AdviceBudget(room(), RIGHTS, budget=1, when='mistakes')
    assert mentor.advise(3) == -1  # it has not seen the learner there
    mentor.record_action(3, RIGHT)
    assert mentor.advise(3) == -1
    mentor.record_action(3, UP)
    assert advice(mentor, 3, 3) == [RIGHT, RIGHT]
    mentor.record_action(4, UP)
    assert mentor.advise(4) == -1  # the budget is used up


def test_without_a_limit_mistakes_do_not_matter():
    assert AdviceBudget(room(), RIGHTS, when='mistakes').advise(3) == RIGHT


def test_importance_is_the_gap_between_the_best_and_the_worst_action():
    # `..G`, intended 0.8, two steps, the mentor goes right: v(1) over two steps
    # = 0.8*10 + 0.2*(-1 + v1(0)), v1(0) = -1 -> 7.6; v(0) = -1 + v1(1) = -1 + 7.8 = 6.8.
    # Q(1, right) = 0.8*10 + 0.2*(-1 + 6.8) = 9.16; Q(1, left) = 0.2*10 + 0.8*5.8 = 6.64.
    gaps = importance(corridor(limit=2), np.array([RIGHT, RIGHT, -1], dtype=np.int8))
    assert gaps.tolist() == pytest.approx([0.0, 2.52, 0.0])


def test_an_important_mentor_advises_in_the_half_of_the_states_with_larger_gaps():
    world = World(grid('..G', '.#.', '...'))
    policy = np.array([UP, LEFT, UP, UP, -1, UP, RIGHT, RIGHT, -1], dtype=np.int8)
    mentor = AdviceBudget(world, policy, budget=9, when='important')
    gaps = importance(world, policy)
    advised = [s for s in range(9) if mentor.advise(s) >= 0]
    assert 3 <= len(advised) < 7
    assert min(gaps[advised]) >= max(
        gaps[s] for s in np.flatnonzero(world.free) if s not in advised)


@pytest.mark.parametrize('budget, when, message', [
    (-1, 'early', 'budget must be at least 0, got -1'),
    (1, 'late', "advising must be one of early, important, mistakes, got 'late'")])
def test_an_impossible_budget_is_rejected(budget, when, message):
    with pytest.raises(MentorError) as error:
        validate_advice_budget(budget, when)
    assert str(error.value) == message


def test_an_important_mentor_in_a_world_without_a_model_is_rejected():
    with pytest.raises(MentorError, match="advising 'important' must know what an action leads "):
        AdviceBudget(World(Spaces(2, ('a', 'b'), 9)), [0, 0], budget=1, when='important')


def test_an_important_mentor_in_a_world_without_a_grid():
    # Values of run, stop: 4, 0. Gaps: 4 - 0 when on; worn 0 - (-5 + 4) = 1. Median: 2.5
    world, policy = World(machine()), np.array([0, 1, -1], dtype=np.int8)
    assert importance(world, policy) == pytest.approx([4.0, 1.0, 0.0])
    assert advice(AdviceBudget(world, policy, budget=1, when='important'), 1, 0) == [-1, 0]


def test_a_budget_has_room_for_many_actions():
    mentor = AdviceBudget(World(hall(3, 300)), [299, 0, -1], budget=2, when='mistakes')
    mentor.record_action(0, 298)
    assert advice(mentor, 0, 1) == [299, -1]
    assert mentor.last_actions.tolist() == [298, -1, -1]
