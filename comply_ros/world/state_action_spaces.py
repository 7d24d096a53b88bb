# SPDX-License-Identifier: Apache-2.0
"""`Spaces`: the states and actions of a world, of which nobody knows what an action leads to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
import hashlib

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.grid import MapError, MOST_STEPS

MOST_ACTIONS = 2 ** 15 - 1  # of int16
MOST_PAIRS = 2 ** 31 - 1  # states times actions


class EqualByHash:
    """Worlds with arrays: two of a kind are equal if their `sha256` are."""

    @property
    def sha256(self) -> str:
        """SHA-256 (hex) of all that makes worlds differ."""
        raise NotImplementedError

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self.sha256 == other.sha256

    def __hash__(self) -> int:
        return hash(self.sha256)


@dataclass(frozen=True, eq=False)
class Spaces(EqualByHash):
    """
    The states and actions of a world without a model, such as a robot that learns as it acts.

    Parameters
    ----------
    n_states: number of states.
    actions: the names of the actions.
    step_limit: number of steps after which an episode is truncated.
    available: `available[s, a]`, bool: whether state s has action a; None for all actions in
        every state.

    Raises
    ------
    MapError: naming the rule that is broken.

    """

    n_states: int
    actions: tuple[str, ...]
    step_limit: int
    available: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        validate_action_names(self.actions)
        validate_step_limit(self.step_limit)
        if type(self.n_states) is not int or not 1 <= self.n_states <= MOST_PAIRS // len(
                self.actions):
            raise MapError(f'a world must have at least one state, and at most {MOST_PAIRS} pairs '
                           f'of a state and an action, got {self.n_states!r} states')
        shape = (self.n_states, len(self.actions))
        if self.available is not None and (self.available.shape != shape
                                           or self.available.dtype != np.bool_):
            raise MapError(f'available must be bool of shape {shape}, got {self.available.dtype} '
                           f'of shape {self.available.shape}')
        if self.available is not None and not self.available.any():
            raise MapError('a world must have a state with an action, got none')

    @cached_property
    def sha256(self) -> str:
        """
        SHA-256 (hex) of all fields: equal hashes mean equal spaces.

        It is that of these bytes, all numbers little-endian: the text `comply_ros spaces 1` and a
        line feed; the number of actions (int64), and of each its number of bytes (int64) and its
        name in UTF-8; the number of states and the step limit (int64 each); then `available`, a
        byte (0 or 1) for each action of each state.
        """
        sha = hashlib.sha256(b'comply_ros spaces 1\n' + action_bytes(self.actions))
        sha.update(int64_bytes(self.n_states, self.step_limit))
        available = self.available
        if available is None:
            available = np.ones((self.n_states, len(self.actions)), dtype=bool)
        sha.update(available.astype('u1').tobytes())
        return sha.hexdigest()


def int64_bytes(*numbers: int) -> bytes:
    """Whole numbers as a hash takes them: int64, little-endian."""
    return np.array(numbers, dtype='<i8').tobytes()


def action_bytes(actions: Sequence[str]) -> bytes:
    """Names of actions as a hash takes them: their number, then the size and bytes of each."""
    names = [name.encode() for name in actions]
    return int64_bytes(len(names)) + b''.join(int64_bytes(len(name)) + name for name in names)


def validate_action_names(actions: Sequence[str]) -> None:
    """
    Return if a world can have actions with these names.

    Raises
    ------
    MapError: unless there is at least one, and all are different texts in one line.

    """
    if not 1 <= len(actions) <= MOST_ACTIONS:
        raise MapError(f'a world must have 1 to {MOST_ACTIONS} actions, got {len(actions)}')
    for number, name in enumerate(actions):
        if not isinstance(name, str) or not name.isprintable() or name.strip() != (name or None):
            raise MapError('the name of an action must be a printable text without blanks at its '
                           f'ends, got {name!r:.80} for action {number}')
    if len(set(actions)) < len(actions):
        twice = next(name for number, name in enumerate(actions) if name in actions[:number])
        raise MapError(f'the names of actions must differ, got {twice!r} twice')


def validate_step_limit(step_limit: int) -> None:
    """
    Return if episodes of a world can have this limit.

    Raises
    ------
    MapError: unless it is a whole number from 1 to 1,000,000.

    """
    if type(step_limit) is not int or not 1 <= step_limit <= MOST_STEPS:
        raise MapError(f'step_limit must be a whole number in [1, {MOST_STEPS}], got '
                       f'{step_limit!r:.80}')
