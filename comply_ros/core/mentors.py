# SPDX-License-Identifier: Apache-2.0
"""Mentors of every quality: each is one recommended action for every state (3.1)."""

from typing import NamedTuple

import numpy as np

from comply_ros.core.grid import NO_ACTION
from comply_ros.core.method import find_method
from comply_ros.core.planning import (
    action_values,
    greedy,
    optimal_policy,
    optimal_values,
    Yardstick,
)
from comply_ros.core.training import Training

CLOSE_ENOUGH = 0.005  # a snapshot this near to the wanted optimality ends the search
SNAPSHOT_ITERATIONS = 600


class MentorError(ValueError):
    """A mentor that does not exist; the message names the rule and the value."""


class Spec(NamedTuple):
    """What `kind:value` says: the kind, and its number or path (None where the kind has none)."""

    kind: str
    value: object = None


def parse_spec(text):
    """
    `Spec` of a mentor as it is written: `optimal`, `noisy:0.2`, `snapshot:0.75`, `file:PATH`.

    Raises
    ------
    MentorError: for an unknown kind, a missing value or one out of its range.

    """
    kind, colon, value = text.partition(':')
    if kind not in KINDS:
        raise MentorError(f'a mentor must be one of {", ".join(KINDS.values())}, got {text!r}')
    wanted = KINDS[kind].partition(':')[2]
    if bool(wanted) != bool(value) or bool(colon) != bool(wanted):
        raise MentorError(f'this mentor is written {KINDS[kind]}, got {text!r}')
    return Spec(kind, _share(kind, value) if wanted in ('P', 'Q') else value or None)


def _share(kind, text):
    name = f'the {KINDS[kind][-1]} of {KINDS[kind]}'
    try:
        value = float(text)
    except ValueError:
        raise MentorError(f'{name} must be a number, got {text!r}') from None
    if not 0 <= value <= 1:
        raise MentorError(f'{name} must lie in [0, 1], got {text!r}')
    return value


def make_policy(spec, world, seed, on_progress=lambda share: None):
    """
    `advice[s]`, int8, of every mentor but `file`; -1 for no advice.

    spec: `Spec`.
    world: the `World`.
    seed: which one of the mentors of this kind.
    on_progress: told the share that is done, from 0 to 1, by a mentor that takes long.

    """
    generator = np.random.Generator(np.random.PCG64(seed))
    if spec.kind == 'none':
        return np.full(len(world.free), NO_ACTION, dtype=np.int8)
    if spec.kind == 'optimal':
        return optimal_policy(world)
    if spec.kind == 'adversarial':
        return adversarial_policy(world)
    if spec.kind == 'random':
        return noisy_policy(world, 1.0, generator)
    if spec.kind == 'noisy':
        return noisy_policy(world, spec.value, generator)
    return snapshot_policy(world, spec.value, seed, on_progress)


def adversarial_policy(world):
    """`advice[s]`: the action with the lowest optimal value in every state."""
    q = action_values(world, optimal_values(world))
    return greedy(np.where(world.available, -q, -np.inf), world.free)


def noisy_policy(world, noise, generator):
    """`advice[s]`: optimal, but in a share `noise` of the states any action of the cell."""
    spoiled = generator.random(len(world.free)) < noise
    tickets = np.where(world.available, generator.random(world.available.shape), -np.inf)
    return np.where(spoiled, greedy(tickets, world.free), optimal_policy(world)).astype(np.int8)


def snapshot_policy(world, level, seed, on_progress):
    """
    `advice[s]`: greedy (3.5) towards a half-trained SARSA learner, section 3.3.

    Of all iterations of one learning, the one whose exact optimality is nearest to `level`.
    """
    yardstick = Yardstick(world)
    training = Training(
        world, np.full(len(world.free), NO_ACTION), find_method('sarsa', 'published'), seed)
    nearest, distance = None, float('inf')
    for number in range(SNAPSHOT_ITERATIONS):
        training.iterate()
        policy = greedy(training.memory.q, world.free)
        away = abs(yardstick.optimality(yardstick.return_of(policy)) - level)
        if away < distance:
            nearest, distance = policy, away
        on_progress(number / SNAPSHOT_ITERATIONS)
        if distance < CLOSE_ENOUGH:
            break
    return nearest


KINDS = {
    'optimal': 'optimal', 'random': 'random', 'adversarial': 'adversarial', 'noisy': 'noisy:P',
    'snapshot': 'snapshot:Q', 'file': 'file:PATH', 'none': 'none'}
