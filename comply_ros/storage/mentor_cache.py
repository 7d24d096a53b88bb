# SPDX-License-Identifier: Apache-2.0
"""Mentors from files, and those that take long to make, remembered for the next time."""

import hashlib
import os
from pathlib import Path
import tempfile

from comply_ros.learner.snapshot_mentor import make_policy
from comply_ros.mentor.mentor_policies import MentorError, parse_mentor_spec, sparse_policy
from comply_ros.mentor.policy_text import format_policy, parse_policy, PolicyError
from comply_ros.numerics.jit import cache_folder, source_hash
from comply_ros.storage.bounded_yaml import read_text, UnreadableError
from comply_ros.storage.run_files import aside


def read_mentor_spec(text):
    """
    `MentorSpec` of a mentor; the `file:` kind carries the text of its file, read now.

    Raises
    ------
    MentorError: for an unknown mentor or a file that cannot be read.

    """
    spec = parse_mentor_spec(text)
    if spec.kind != 'file':
        return spec
    try:
        return spec._replace(value=read_text(spec.value))
    except UnreadableError as error:
        raise MentorError(f'a policy file must be readable, got {spec.value!r} '
                          f'({error})') from None


def read_policy(path, world):
    """
    `policy[s]`, int8, of a policy file; -1 for no advice.

    Raises
    ------
    PolicyError: if it cannot be read, or does not fit the world.

    """
    try:
        return parse_policy(read_text(path), world)
    except UnreadableError as error:
        raise PolicyError(f'a policy file must be readable, got {str(path)!r} '
                          f'({error})') from None


def write_policy(path, policy, world):
    """
    Write a policy file aside, then rename it.

    Raises
    ------
    PolicyError: if it cannot be written; what was there stays.

    """
    try:
        place = Path(path).expanduser()
        if place.exists() and not place.is_file():
            raise PolicyError(f'a policy must be written to a file, got {str(path)!r}')
        with aside(place) as part:
            part.write_text(format_policy(policy, world))
        return
    except OSError as error:
        reason = error.strerror.lower()
    except RuntimeError:  # ~USER/
        reason = 'no such user'
    except PolicyError:
        raise
    except ValueError:  # a NUL, or half of a character
        reason = 'no file can have this name'
    raise PolicyError(f'a policy file must be one that can be written, got {str(path)!r} '
                      f'({reason})')


def is_slow(spec, world, seed):
    """Tell whether this mentor must first be generated, and is not remembered."""
    return spec.kind == 'snapshot' and not _remembered(spec, world, seed).exists()


def mentor_policy(spec, world, seed, on_progress=lambda share: None):
    """
    `advice[s]`, int8, of a mentor from `read_mentor_spec`; -1 for no advice.

    Raises
    ------
    PolicyError: for a policy file that does not fit the world.

    """
    policy = _whole_policy(spec, world, seed, on_progress)
    return sparse_policy(policy, world, spec.coverage, seed)


def _whole_policy(spec, world, seed, on_progress):
    if spec.kind == 'file':
        return parse_policy(spec.value, world)
    if spec.kind != 'snapshot':
        return make_policy(spec, world, seed, on_progress)
    path = _remembered(spec, world, seed)
    try:
        return parse_policy(path.read_text(), world)
    except (OSError, UnicodeDecodeError, PolicyError):  # not there yet, or spoiled: make it
        policy = make_policy(spec, world, seed, on_progress)
    _remember(path, format_policy(policy, world))
    return policy


def _remembered(spec, world, seed):
    """File of a generated mentor: of this world, this kind and this state of the sources."""
    key = f'{world.grid.sha256} {spec.kind} {spec.value!r} {seed} {source_hash()}'
    return cache_folder() / 'mentors' / f'{hashlib.sha256(key.encode()).hexdigest()[:24]}.txt'


def _remember(path, text):
    """Write a file aside and rename it; a cache that cannot be written is no reason to stop."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile('w', dir=path.parent, delete=False) as aside:
            aside.write(text)
        os.replace(aside.name, path)
    except OSError:
        return
