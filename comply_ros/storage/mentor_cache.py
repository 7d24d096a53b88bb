# SPDX-License-Identifier: Apache-2.0
"""Policies of mentors; those that take long to generate are cached for the next time."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
import hashlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.learner.learning_result import LearningError
from comply_ros.learner.mentor_factory import make_policy
from comply_ros.mentor.mentor_policies import sparse_policy
from comply_ros.mentor.mentor_spec import (
    FROM_FILES,
    LEARNER,
    MentorError,
    MentorSpec,
    parse_mentor_spec,
    SEVERAL,
)
from comply_ros.mentor.policy_text import format_policy, parse_policy
from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.mentor.several_mentors import split_mentors
from comply_ros.storage.file_system import atomic_write, PathError
from comply_ros.storage.kernel_cache import cache_folder
from comply_ros.storage.learning_file import read_learning
from comply_ros.storage.text_and_yaml_files import read_text
from comply_ros.storage.versions import ALGORITHM_VERSION, FORMAT_VERSION
from comply_ros.world.mdp import World


def read_mentor_spec(text: str) -> MentorSpec:
    """
    `MentorSpec` of a mentor; one from a file carries what is in it, read now.

    The value of the `file:` kind is a text, that of the `learned:` kind a `Learned`, that of
    several mentors a table of each by its name.

    Raises
    ------
    MentorError: for an unknown mentor, one that follows a running learner, or a file that cannot
        be read.

    """
    mentors = split_mentors(text)
    if len(mentors) > 1:
        return MentorSpec(SEVERAL, {name: _read_one(each) for name, each in mentors.items()})
    return _read_one(text)


def _read_one(text: str) -> MentorSpec:
    spec = parse_mentor_spec(text)
    if spec.kind == LEARNER:
        raise MentorError(f'a mentor that follows a running learner must be a node of its own, '
                          f'started with -p mentor:={text}; here, use learned:FILE.npz')
    if spec.kind == 'learned':
        try:
            return spec._replace(value=read_learning(spec.value))
        except LearningError as error:
            raise MentorError(str(error)) from None
    if spec.kind != 'file':
        return spec
    try:
        return spec._replace(value=read_text(spec.value))
    except PathError as error:
        raise MentorError(f'a policy file must be readable, got {spec.value!r} '
                          f'({error})') from None


def is_slow(spec: MentorSpec, world: World, seed: int) -> bool:
    """Whether this mentor takes long to generate, and is not in the cache."""
    return any(each.kind == 'snapshot' and not _cache_file(each, world, seed + place).exists()
               for place, each in enumerate(spec.by_name().values()))


def mentor_policy(spec: MentorSpec, world: World, seed: int,
                  on_progress: Callable[[float], None] = lambda share: None) -> NDArray[Any]:
    """
    `advice[s]` of a mentor from `read_mentor_spec`; -1 for no advice.

    Of several mentors in rows, `advice[m * n_states + s]`.

    seed: which one of the mentors of this kind; each of several has the next number.
    on_progress: called with the share that is done, from 0 to 1, by a mentor that takes long.

    Raises
    ------
    PolicyError: for a policy file, or a learning, that does not fit the world.

    """
    if spec.kind == SEVERAL:
        policies = []
        for place, (name, each) in enumerate(spec.by_name().items()):
            with _named(name):
                policies.append(mentor_policy(each, world, seed + place, on_progress))
        return np.concatenate(policies)
    if spec.kind in FROM_FILES:
        policy = policy_of_file(spec, world)
    elif spec.kind == 'snapshot':
        policy = _cached_policy(spec, world, seed, on_progress)
    else:
        policy = make_policy(spec, world, seed, on_progress)
    return sparse_policy(policy, world, spec.coverage, seed)


def policy_of_file(spec: MentorSpec, world: World) -> NDArray[Any]:
    """`policy[s]` that a mentor from a file carries; the errors are those of `mentor_policy`."""
    if spec.kind == 'file':
        return parse_policy(spec.value, world)
    try:
        spec.value.validate(world)
    except LearningError as error:
        raise PolicyError(str(error)) from None
    return spec.value.policy


def _cached_policy(spec: MentorSpec, world: World, seed: int,
                   on_progress: Callable[[float], None]) -> NDArray[Any]:
    """Return a policy from the cache, where it is written if it was not there."""
    path = _cache_file(spec, world, seed)
    try:
        return parse_policy(path.read_text(), world)
    except (OSError, UnicodeDecodeError, PolicyError):  # it is missing, or spoiled
        policy = make_policy(spec, world, seed, on_progress)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as part:
            part.write_text(format_policy(policy, world))
    except OSError:  # a cache that cannot be written is no reason to stop
        pass
    return policy


def _cache_file(spec: MentorSpec, world: World, seed: int) -> Path:
    key = (world.sha256, spec.kind, spec.value, seed, FORMAT_VERSION, ALGORITHM_VERSION)
    name = hashlib.sha256(repr(key).encode()).hexdigest()[:24]
    return cache_folder() / 'mentors' / f'{name}.txt'


def validate_files(spec: MentorSpec, world: World) -> None:
    """
    Return if mentors from files fit a world.

    Raises
    ------
    PolicyError: otherwise.

    """
    for name, each in spec.by_name().items():
        if each.kind in FROM_FILES:
            with _named(name):
                policy_of_file(each, world)


@contextmanager
def _named(mentor: str) -> Generator[None]:
    """Say in errors of a policy which of several mentors it is of."""
    try:
        yield
    except PolicyError as error:
        raise PolicyError(f'mentor {mentor}: {error}') if mentor else error from None
