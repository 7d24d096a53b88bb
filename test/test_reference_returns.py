# SPDX-License-Identifier: Apache-2.0
"""What a learning curve is measured against, computed aside."""

from node_processes import wait_until
import numpy as np
import pytest
from tiny_worlds import room

from comply_ros.dashboard.reference_returns import ReferenceReturnsCache
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.planning import optimal_policy, ReferenceReturns


def test_levels_are_the_exact_returns_of_the_best_policy_and_of_the_mentor():
    world, levels = room(), ReferenceReturnsCache()
    advice = optimal_policy(world)
    advice[0] = NO_ACTION
    wait_until(lambda: None not in levels.of(world, advice), 'both levels')
    reference = ReferenceReturns(world)
    assert levels.of(world, advice) == (
        pytest.approx(reference.optimal_return), pytest.approx(reference.return_of(advice)))


def test_a_mentor_that_says_nothing_has_no_level():
    world, levels = room(), ReferenceReturnsCache()
    advice = optimal_policy(world)
    wait_until(lambda: levels.of(world, advice)[1] is not None, 'level of the mentor')
    silent = np.full_like(advice, NO_ACTION)
    wait_until(lambda: levels.of(world, silent)[1] is None, 'end of the level')
    assert levels.of(world, silent)[0] is not None


def test_another_world_has_other_levels():
    levels, worlds = ReferenceReturnsCache(), (room(), room(step=-2.0))
    seen = []
    for world in worlds:
        assert levels.of(world, None) == (None, None)
        seen.append(wait_until(lambda: levels.of(world, None)[0], 'optimal level'))
    assert seen[0] > seen[1]
