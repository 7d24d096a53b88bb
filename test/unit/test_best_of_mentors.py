# SPDX-License-Identifier: Apache-2.0
"""What several mentors are worth: each alone, and the best of them in each state."""

import numpy as np
import pytest
from tiny_worlds import corridor

from comply_ros.mentor.best_of_mentors import best_of_mentors, mentor_returns
from comply_ros.mentor.mentor_spec import MentorSpec
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World
from comply_ros.world.planning import (
    policy_probabilities,
    policy_values,
    ReferenceReturns,
)

BAR_GRID = World(read_map('bar_grid', 'published'))
SPEC = read_mentor_spec('optimal + noisy:0.5 + adversarial')


def test_in_each_state_the_mentor_that_is_worth_most_there_is_followed():
    world = corridor()
    left, right = 0, 1
    first = np.where(world.free, right, -1)  # reaches the goal from everywhere
    second = np.where(world.free, left, -1)  # never does
    best = best_of_mentors(world, np.concatenate([second, first]))
    assert best[world.free].tolist() == [right] * int(world.free.sum())


def test_where_one_has_no_advice_another_counts():
    world = corridor()
    nobody, right = np.full(world.n_states, -1), np.where(world.free, 1, -1)
    assert (best_of_mentors(world, np.concatenate([nobody, right])) == right).all()
    assert (best_of_mentors(world, np.concatenate([nobody, nobody])) == -1).all()


def test_it_is_worth_at_least_the_best_mentor_in_every_state():
    advice = mentor_policy(SPEC, BAR_GRID, 0)
    rows = advice.reshape(3, -1)
    values = [policy_values(BAR_GRID, policy_probabilities(BAR_GRID, row)) for row in rows[1:]]
    best = best_of_mentors(BAR_GRID, rows[1:].ravel())
    found = policy_values(BAR_GRID, policy_probabilities(BAR_GRID, best))
    assert (found >= np.max(values, axis=0) - 1e-9)[BAR_GRID.free].all()


def test_each_mentor_has_its_own_return():
    reference = ReferenceReturns(BAR_GRID)
    returns = mentor_returns(SPEC, reference, mentor_policy(SPEC, BAR_GRID, 0))
    assert list(returns) == ['optimal', 'noisy_0_5', 'adversarial']
    assert returns['optimal'] == pytest.approx(reference.optimal_return)
    assert returns['adversarial'] < returns['noisy_0_5'] < returns['optimal']


def test_a_single_mentor_has_one_without_a_name():
    spec = MentorSpec('optimal')
    returns = mentor_returns(spec, ReferenceReturns(BAR_GRID), mentor_policy(spec, BAR_GRID, 0))
    assert list(returns) == ['']
