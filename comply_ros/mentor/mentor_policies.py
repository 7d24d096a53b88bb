# SPDX-License-Identifier: Apache-2.0
"""Mentors of every quality: each is one recommended action for every state (3.1)."""

from typing import NamedTuple

import numpy as np

from comply_ros.mentor.advice_budget import MentorError
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.planning import action_values, greedy, optimal_policy, optimal_values


class MentorSpec(NamedTuple):
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


def parse_mentor_spec(text):
    """
    `MentorSpec` of a mentor as it is written: `optimal`, `noisy:0.2`, `snapshot:0.75@0.2`, `file:PATH`.

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
    """Return the `MentorSpec` of what stands before an @."""
    kind, colon, value = text.partition(':')
    if kind not in KINDS:
        raise MentorError(f'a mentor must be one of {", ".join(KINDS.values())}, got {text!r}')
    wanted = KINDS[kind].partition(':')[2]
    if bool(wanted) != bool(value) or bool(colon) != bool(wanted):
        raise MentorError(f'this mentor is written {KINDS[kind]}, got {text!r}')
    if wanted in ('P', 'Q'):
        return MentorSpec(kind, _share(f'the {wanted} of {KINDS[kind]}', value))
    return MentorSpec(kind, value or None)


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


KINDS = {
    'optimal': 'optimal', 'random': 'random', 'adversarial': 'adversarial', 'noisy': 'noisy:P',
    'snapshot': 'snapshot:Q', 'file': 'file:PATH', 'none': 'none'}
