# SPDX-License-Identifier: Apache-2.0
"""Mentors of every quality: each is one recommended action for every state (3.1)."""

from typing import NamedTuple

import numpy as np

from comply_ros.core.advising import MentorError
from comply_ros.core.grid import NO_ACTION
from comply_ros.core.methods import find_method
from comply_ros.core.planning import (
    action_values,
    greedy,
    optimal_policy,
    optimal_values,
    Yardstick,
)
from comply_ros.core.training import Training

CLOSE_ENOUGH = 0.005  # a snapshot this near to the wanted optimality ends the search; nearer
# where more would pass for optimal: half of what is missing to it
SNAPSHOT_ITERATIONS = 600


class Spec(NamedTuple):
    """
    What `kind:value@coverage` says.

    Attributes
    ----------
    value: number or path, None where the kind has none.
    coverage: share of the states in which it has advice.

    """

    kind: str
    value: object = None
    coverage: float = 1.0


def parse_spec(text):
    """
    `Spec` of a mentor as it is written: `optimal`, `noisy:0.2`, `snapshot:0.75@0.2`, `file:PATH`.

    Raises
    ------
    MentorError: for an unknown kind, a missing value or one out of its range.

    """
    written, at, share = text.rpartition('@')
    if at and not (written.startswith('file:') and not _is_number(share)):
        return _spec(written)._replace(
            coverage=_share('the coverage of MENTOR@COVERAGE', share))
    return _spec(text)


def _spec(text):
    """Return the `Spec` of what stands before an @."""
    kind, colon, value = text.partition(':')
    if kind not in KINDS:
        raise MentorError(f'a mentor must be one of {", ".join(KINDS.values())}, got {text!r}')
    wanted = KINDS[kind].partition(':')[2]
    if bool(wanted) != bool(value) or bool(colon) != bool(wanted):
        raise MentorError(f'this mentor is written {KINDS[kind]}, got {text!r}')
    if wanted in ('P', 'Q'):
        return Spec(kind, _share(f'the {wanted} of {KINDS[kind]}', value))
    return Spec(kind, value or None)


def _is_number(text):
    try:
        return float(text) is not None
    except ValueError:
        return False


def _share(name, text):
    try:
        value = float(text)
    except ValueError:
        raise MentorError(f'{name} must be a number, got {text!r}') from None
    if not 0 <= value <= 1:
        raise MentorError(f'{name} must lie in [0, 1], got {text!r}')
    return value


def sparse_policy(policy, world, coverage, seed):
    """`advice[s]` in a share of the states only, drawn by seed; -1 in the others."""
    if coverage == 1.0:
        return policy
    states = np.flatnonzero(world.free)
    generator = np.random.Generator(np.random.PCG64(seed))
    kept = generator.permutation(states)[:round(coverage * len(states))]
    sparse = np.full_like(policy, NO_ACTION)
    sparse[kept] = policy[kept]
    return sparse


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
    spoiled, anything = _anything(world, noise, generator)
    if spoiled[world.free].all():  # the optimal policy would be planned for nothing
        return anything
    return np.where(spoiled, anything, optimal_policy(world)).astype(np.int8)


def spoiled_policy(policy, world, noise, generator):
    """`advice[s]` of a policy, but in a share `noise` of the states any action of the cell."""
    return np.where(*_anything(world, noise, generator), policy).astype(np.int8)


def _anything(world, noise, generator):
    """Return `spoiled[s]`, a share of the states, and any action of the cell in each state."""
    spoiled = generator.random(len(world.free)) < noise
    tickets = np.where(world.available, generator.random(world.available.shape), -np.inf)
    return spoiled, greedy(tickets, world.free)


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
        if distance < min(CLOSE_ENOUGH, (1.0 - level) / 2.0):
            break
    return nearest


KINDS = {
    'optimal': 'optimal', 'random': 'random', 'adversarial': 'adversarial', 'noisy': 'noisy:P',
    'snapshot': 'snapshot:Q', 'file': 'file:PATH', 'none': 'none'}
