# SPDX-License-Identifier: Apache-2.0
"""The returns that a learning curve is compared with, computed in the background."""

import numpy as np
import pytest
from tiny_worlds import room
from waiting import wait_until

from comply_ros.dashboard.reference_returns_cache import ReferenceReturnsCache
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.planning import optimal_policy, ReferenceReturns


def test_they_are_the_exact_returns_of_the_optimal_policy_and_of_the_mentor():
    world, cache = room(), ReferenceReturnsCache()
    policy = optimal_policy(world)
    policy[0] = NO_ACTION
    wait_until(lambda: None not in cache.get(world, policy), 'both returns')
    reference = ReferenceReturns(world)
    assert cache.get(world, policy) == (
        pytest.approx(reference.optimal_return), pytest.approx(reference.return_of(policy)))


def test_a_mentor_without_any_advice_has_no_return():
    world, cache = room(), ReferenceReturnsCache()
    policy = optimal_policy(world)
    wait_until(lambda: cache.get(world, policy)[1] is not None, 'return of the mentor')
    empty = np.full_like(policy, NO_ACTION)
    wait_until(lambda: cache.get(world, empty)[1] is None, 'end of that return')
    assert cache.get(world, empty)[0] is not None


def test_another_world_has_other_returns():
    cache, worlds = ReferenceReturnsCache(), (room(), room(step=-2.0))
    seen = []
    for world in worlds:
        assert cache.get(world, None) == (None, None)
        seen.append(wait_until(lambda: cache.get(world, None)[0], 'optimal return'))
    assert seen[0] > seen[1]
