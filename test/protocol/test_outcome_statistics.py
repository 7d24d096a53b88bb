# SPDX-License-Identifier: Apache-2.0
"""Counts of outcomes are compared with the model: right ones pass, and rare wrong ones fail."""

from math import exp, log

import numpy as np
import pytest
from tiny_tables import frozen_lake
from tiny_worlds import grid

from comply_ros.protocol.outcome_statistics import (
    chi_squared_tail,
    count_tail,
    OutcomeCounts,
    outcomes,
)
from comply_ros.world.mdp import World

ROOM = World(grid('.....', '.....', '.....', '....G', intended=0.97))


# Critical values of tables: 3.841 and 5.991 at 0.05, 10.828 at 0.001, 16.919 at 0.05.
@pytest.mark.parametrize('x, degrees, tail', [
    (3.841, 1, 0.05), (5.991, 2, 0.05), (10.828, 1, 0.001), (16.919, 9, 0.05), (7.0, 0, 1.0)])
def test_the_tail_of_chi_squared(x, degrees, tail):
    assert chi_squared_tail(x, degrees) == pytest.approx(tail, rel=2e-3)


def test_the_bound_of_a_count_worked_by_hand():
    # 10 where 2 are expected: 2 exp(-(10 ln 5 - 8)) = 2 exp(-8.094) = 6.1e-4.
    assert count_tail(10, 2.0) == pytest.approx(2.0 * exp(-(10.0 * log(5.0) - 8.0)))
    assert count_tail(10, 2.0) == pytest.approx(6.1e-4, rel=0.01)
    assert count_tail(0, 5.0) == pytest.approx(2.0 * exp(-5.0)) and count_tail(3, 3.0) == 1.0
    assert count_tail(0, 0.0) == 1.0 and count_tail(1, 0.0) == 0.0


def test_outcomes_of_a_grid_and_of_a_table_add_up_to_1():
    for world in (ROOM, World(frozen_lake())):
        for s, a in zip(*world.available.nonzero()):
            assert sum(outcomes(world, s, a).values()) == pytest.approx(1.0)


def wrong_comparisons(draws, replace_rare=lambda distance: distance, seed=0):
    """
    Return what fails of so many draws in each state for each action.

    replace_rare: the distance of a rare outcome instead of that of the model.
    """
    rng, counts = np.random.default_rng(seed), OutcomeCounts(ROOM)
    for s, a in zip(*ROOM.available.nonzero()):
        expected = outcomes(ROOM, s, a)
        kinds = list(expected)
        for k in rng.choice(len(kinds), size=draws, p=list(expected.values())):
            outcome = kinds[k]
            if expected[outcome] < 0.5:
                wanted = s + replace_rare(outcome[0] - s)
                outcome = next((each for each in kinds if each[0] == wanted), outcome)
            counts.add(int(s), int(a), *outcome)
    return [expected for kept, expected, _ in counts.comparisons() if not kept]


@pytest.mark.parametrize('seed', range(5))
def test_a_right_world_has_no_wrong_comparison(seed):
    assert wrong_comparisons(40, seed=seed) == []


def test_slips_that_all_go_to_the_left_are_found_where_none_is_expected_25_times():
    # In each state each slip is expected 150 * 0.01 = 1.5 times, in all some 70 times each way.
    wrong = wrong_comparisons(150, lambda distance: -1 if distance == 1 else distance)
    assert '72.0 times a state whose number is +1, where any action seldom leads there' in wrong
    assert all('seldom' in each for each in wrong)
