# SPDX-License-Identifier: Apache-2.0
"""Mentors of every quality: each is one recommended action for every state (3.1)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import action_values, greedy, optimal_policy, optimal_values

Policy = NDArray[Any]  # of the `action_type` of the world


def sparse_policy(policy: Policy, world: World, coverage: float, seed: int) -> Policy:
    """`advice[s]` in a share of the states only, drawn by seed; -1 in the others."""
    if coverage == 1.0:
        return policy
    states = np.flatnonzero(world.free)
    generator = np.random.Generator(np.random.PCG64(seed))
    covered = generator.permutation(states)[:round(coverage * len(states))]
    sparse = np.full_like(policy, NO_ACTION)
    sparse[covered] = policy[covered]
    return sparse


def adversarial_policy(world: World) -> Policy:
    """`advice[s]`: the action with the lowest optimal value in every state."""
    q = action_values(world, optimal_values(world))
    return greedy(np.where(world.available, -q, -np.inf), world.free)


def noisy_policy(world: World, noise: float, generator: np.random.Generator) -> Policy:
    """`advice[s]`: optimal, but in a share `noise` of the states any action of the state."""
    spoiled, random_actions = _random_actions(world, noise, generator)
    if spoiled[world.free].all():  # the optimal policy is not needed, and slow to plan
        return random_actions
    return np.where(spoiled, random_actions, optimal_policy(world)).astype(world.action_type)


def spoiled_policy(policy: Policy, world: World, noise: float,
                   generator: np.random.Generator) -> Policy:
    """`advice[s]` of a policy, but in a share `noise` of the states any action of the state."""
    return np.where(*_random_actions(world, noise, generator), policy).astype(world.action_type)


def _random_actions(world: World, noise: float,
                    generator: np.random.Generator) -> tuple[NDArray[np.bool_], Policy]:
    """Return `spoiled[s]`, a share of the states, and any action of the state in each state."""
    spoiled = generator.random(len(world.free)) < noise
    priorities = np.where(world.available, generator.random(world.available.shape), -np.inf)
    return spoiled, greedy(priorities, world.free)
