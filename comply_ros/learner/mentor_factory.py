# SPDX-License-Identifier: Apache-2.0
"""Mentors that are snapshots of a training, and one function that makes any mentor."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.mentor_policies import adversarial_policy, noisy_policy
from comply_ros.mentor.mentor_spec import FROM_FILES, MentorError, MentorSpec
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import greedy, optimal_policy, ReferenceReturns

# A snapshot this near to the wanted optimality ends the search; near an optimality of 1, half of
# what is missing to it.
CLOSE_ENOUGH = 0.005
SNAPSHOT_ITERATIONS = 600
UNPLANNED = 'none', 'random'  # kinds of mentors that need no model of the world


def make_policy(spec: MentorSpec, world: World, seed: int,
                on_progress: Callable[[float], None] = lambda share: None) -> NDArray[Any]:
    """
    `advice[s]` of every mentor that is not from a file; -1 for no advice.

    seed: which one of the mentors of this kind.
    on_progress: called with the share that is done, from 0 to 1, by a mentor that takes long.

    Raises
    ------
    MentorError: as `validate_mentor`.

    """
    validate_mentor(spec, world)
    generator = np.random.Generator(np.random.PCG64(seed))
    if spec.kind == 'none':
        return np.full(world.n_states, NO_ACTION, dtype=world.action_type)
    if spec.kind == 'optimal':
        return optimal_policy(world)
    if spec.kind == 'adversarial':
        return adversarial_policy(world)
    if spec.kind == 'random':
        return noisy_policy(world, 1.0, generator)
    if spec.kind == 'noisy':
        return noisy_policy(world, float(spec.value), generator)
    return snapshot_policy(world, float(spec.value), seed, on_progress)


def validate_mentor(spec: MentorSpec, world: World) -> None:
    """
    Return if there can be such a mentor in a world.

    Raises
    ------
    MentorError: for a mentor that must plan, in a world without a model.

    """
    for each in spec.by_name().values():
        if world.model == 'none' and each.kind not in (*UNPLANNED, *FROM_FILES):
            raise MentorError(
                f'a mentor of the kind {each.kind!r} must plan, and nobody knows what an action '
                'leads to in a world without a model: use one from a file (file:PATH), from a '
                'training (learned:FILE.npz), random, none, a person, or a node of your own')


def snapshot_policy(world: World, level: float, seed: int,
                    on_progress: Callable[[float], None]) -> NDArray[Any]:
    """
    `advice[s]`: greedy (3.5) policy of a half-trained SARSA learner, section 3.3.

    Of all iterations of one training, the one whose exact optimality is nearest to `level`.
    """
    reference = ReferenceReturns(world)
    training = Training(
        world, np.full(world.n_states, NO_ACTION), find_method('sarsa', 'published'), seed)
    nearest, distance = np.zeros(0, dtype=world.action_type), float('inf')
    for number in range(SNAPSHOT_ITERATIONS):
        training.iterate()
        policy = greedy(training.state.q, world.free)
        optimality = reference.optimality(reference.return_of(policy))
        # Where the random policy is optimal, so is every other.
        away = abs((1.0 if optimality is None else optimality) - level)
        if away < distance:
            nearest, distance = policy, away
        on_progress(number / SNAPSHOT_ITERATIONS)
        if distance < min(CLOSE_ENOUGH, (1.0 - level) / 2.0):
            break
    return nearest
