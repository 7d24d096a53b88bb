# SPDX-License-Identifier: Apache-2.0
"""`Table`: any finite Markov decision process as a list of outcomes, and the checks of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
import hashlib
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.grid import LARGEST_REWARD, MapError
from comply_ros.world.state_action_spaces import (
    action_bytes,
    EqualByHash,
    int64_bytes,
    validate_action_names,
    validate_step_limit,
)

MOST_STATES = 4096 ** 2
TOLERANCE = 1e-9  # by which the probabilities of an action may miss 1

# What Gymnasium's tabular worlds call `P`: P[s][a] = [(probability, state, reward, terminated)].
Transitions = Mapping[int, Mapping[int, Sequence[tuple[float, int, float, bool]]]] \
    | Sequence[Sequence[Sequence[tuple[float, int, float, bool]]]]


@dataclass(frozen=True, eq=False)
class Table(EqualByHash):
    """
    A world with any states and actions: what each action can lead to, and how likely that is.

    Two tables are equal if their `sha256` are.

    Parameters
    ----------
    actions: the names of the actions.
    first: `first[s * len(actions) + a]`, int64: where the outcomes of action a in state s begin
        in the next three arrays; they end where those of the next action begin. The last element
        is the number of outcomes. An action without outcomes does not exist in that state.
    successor: `successor[k]`, int32: the state that outcome k leads to.
    probability: `probability[k]`, float64, in (0, 1].
    reward: `reward[k]`, float64.
    terminal: `terminal[s]`, bool: whether an episode ends in s; outcomes of it never happen.
    starts: the states in which an episode can start, equally likely.
    step_limit: number of steps after which an episode is truncated.
    positions: `positions[s]`, float64: x and y in metres, for pictures; None for none.
    cells: a character for each state, or '', for pictures in text; None for none.

    Raises
    ------
    MapError: naming the rule that is broken, with the state and the action.

    """

    actions: tuple[str, ...]
    first: NDArray[np.int64]
    successor: NDArray[np.int32]
    probability: NDArray[np.float64]
    reward: NDArray[np.float64]
    terminal: NDArray[np.bool_]
    starts: tuple[int, ...]
    step_limit: int
    positions: NDArray[np.float64] | None = None
    cells: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        validate_action_names(self.actions)
        validate_step_limit(self.step_limit)
        _check_arrays(self)
        _check_outcomes(self)
        _check_starts(self)
        _check_pictures(self)
        stuck = np.flatnonzero(self.reachable & ~self.terminal & ~self.available.any(axis=1))
        if len(stuck):
            raise MapError('a state that can be reached must be terminal or have an action, but '
                           f'state {stuck[0]} has none')

    @property
    def n_states(self) -> int:
        """Number of states."""
        return len(self.terminal)

    @cached_property
    def available(self) -> NDArray[np.bool_]:
        """`available[s, a]`: whether state s has action a; nothing where an episode ends."""
        counts = np.diff(self.first).reshape(self.n_states, len(self.actions))
        return (counts > 0) & ~self.terminal[:, None]

    @cached_property
    def pairs(self) -> NDArray[np.int64]:
        """`pairs[k]`: to which `s * len(actions) + a` outcome k belongs."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """`reachable[s]`: whether an episode can come to state s."""
        found = np.zeros(self.n_states, dtype=bool)
        newest = np.unique(np.array(self.starts, dtype=np.int64))
        n_actions = len(self.actions)
        while len(newest):
            found[newest] = True
            newest = newest[~self.terminal[newest]]
            begin, end = self.first[newest * n_actions], self.first[(newest + 1) * n_actions]
            sizes = end - begin
            skipped = np.repeat(begin - np.cumsum(sizes) + sizes, sizes)
            following = np.unique(self.successor[np.arange(len(skipped)) + skipped])
            newest = following[~found[following]]
        return found

    @cached_property
    def sha256(self) -> str:
        """
        SHA-256 (hex) of the world without its pictures: equal hashes mean equal worlds.

        It is that of these bytes, all numbers little-endian: the text `comply_ros table 1` and a
        line feed; the number of actions (int64), and of each its number of bytes (int64) and its
        name in UTF-8; the numbers of states, of outcomes and of starts, and the step limit (int64
        each); then, without gaps, `first` (int64), `successor` (int32), `probability` (float64),
        `reward` (float64), `terminal` (a byte each, 0 or 1) and `starts` (int64), element by
        element. A reward of -0.0 counts as 0.0.
        """
        sha = hashlib.sha256(b'comply_ros table 1\n' + action_bytes(self.actions))
        sha.update(int64_bytes(self.n_states, len(self.successor), len(self.starts),
                               self.step_limit))
        for array, kind in ((self.first, '<i8'), (self.successor, '<i4'),
                            (self.probability, '<f8'), (self.reward + 0.0, '<f8'),
                            (self.terminal, 'u1')):
            sha.update(array.astype(kind).tobytes())
        sha.update(int64_bytes(*self.starts))
        return sha.hexdigest()

    @classmethod
    def from_transitions(cls, transitions: Transitions, starts: Sequence[int], step_limit: int,
                         actions: Sequence[str] | None = None) -> Table:
        """
        Return the table of `P[s][a] = [(probability, state, reward, terminated), ...]`.

        Outcomes with probability 0 are left out, and equal ones become one. A state is terminal
        if all outcomes that lead there end the episode, and no episode starts there. An outcome
        that ends the episode in any other state leads to an extra terminal state, the last one.

        Parameters
        ----------
        transitions: such as `env.unwrapped.P` of a world of Gymnasium; all states have the same
            number of actions, or less.
        starts: the states in which an episode can start, equally likely.
        step_limit: number of steps after which an episode is truncated.
        actions: names of the actions; None for `0`, `1` and so on.

        Raises
        ------
        MapError: as the class.

        """
        rows = _rows(transitions)
        count = len(actions) if actions is not None else max(
            (a + 1 for row in rows for a in row), default=0)
        _check_rows(rows, count)
        ends, goes_on = _ends(rows)
        terminal = ends & ~goes_on
        terminal[[s for s in starts if 0 <= s < len(rows)]] = False
        sizes, outcomes = [], []
        for s, row in enumerate(rows):
            for a in range(count):
                merged = {} if terminal[s] else _merged(row.get(a, ()), terminal)
                sizes.append(len(merged))
                outcomes += [(s2, p, r) for (s2, r), p in merged.items()]
        if (ends & ~terminal).any():  # the extra state
            sizes += count * [0]
            terminal = np.append(terminal, True)
        successor, probability, reward = np.array(outcomes, dtype=float).reshape(-1, 3).T
        names = tuple(map(str, range(count) if actions is None else actions))
        return cls(names, np.concatenate(([0], np.cumsum(sizes, dtype=np.int64))),
                   successor.astype(np.int32), probability.copy(), reward.copy(), terminal,
                   tuple(map(int, starts)), step_limit)


def _rows(transitions: Transitions) -> list[dict[int, Any]]:
    """Return `{action: outcomes}` of each state."""
    states = len(transitions)
    try:
        rows = [transitions[s] for s in range(states)]
    except KeyError as error:
        raise MapError(f'the states must be numbered from 0 to {states - 1}, but there is no '
                       f'state {error}') from None
    return [dict(row) if isinstance(row, Mapping) else dict(enumerate(row)) for row in rows]


def _check_rows(rows: Sequence[dict[int, Any]], n_actions: int) -> None:
    for s, row in enumerate(rows):
        for a, outcomes in row.items():
            if type(a) is not int or not 0 <= a < n_actions:
                raise MapError(f'an action must lie in [0, {n_actions - 1}], got {a!r} in state '
                               f'{s}')
            for _, s2, _, _ in outcomes:
                if not 0 <= s2 < len(rows):
                    raise MapError(f'an outcome must lead to a state in [0, {len(rows) - 1}], got '
                                   f'{s2} in state {s}, action {a}')


def _ends(rows: Sequence[dict[int, Any]]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return whether an outcome ends in each state, and whether one leads there and goes on."""
    ends, goes_on = np.zeros(len(rows), dtype=bool), np.zeros(len(rows), dtype=bool)
    for s, row in enumerate(rows):
        for p, s2, _, done in chain.from_iterable(row.values()):
            if p and done:
                ends[s2] = True
            elif p and s2 != s:
                goes_on[s2] = True
    return ends, goes_on


def _merged(outcomes: Sequence[tuple[float, int, float, bool]],
            terminal: NDArray[np.bool_]) -> dict[tuple[int, float], float]:
    """Return the probability of each (state, reward); the extra state comes after the last."""
    merged: dict[tuple[int, float], float] = {}
    for p, s2, r, done in outcomes:
        if p:
            key = (len(terminal) if done and not terminal[s2] else int(s2), float(r))
            merged[key] = merged.get(key, 0.0) + float(p)
    return merged


def _check_arrays(table: Table) -> None:
    states, outcomes = len(table.terminal), len(table.successor)
    if not 1 <= states <= MOST_STATES:
        raise MapError(f'a world must have 1 to {MOST_STATES} states, got {states}')
    for name, kind, length in (
            ('terminal', np.bool_, states), ('first', np.int64, states * len(table.actions) + 1),
            ('successor', np.int32, outcomes), ('probability', np.float64, outcomes),
            ('reward', np.float64, outcomes)):
        array = getattr(table, name)
        if array.dtype != kind or array.shape != (length,):
            raise MapError(f'{name} must be {np.dtype(kind)} of shape ({length},), got '
                           f'{array.dtype} of shape {array.shape}')
    if table.first[0] != 0 or table.first[-1] != outcomes or (np.diff(table.first) < 0).any():
        raise MapError(f'first must rise from 0 to the {outcomes} outcomes and never fall')


def _check_outcomes(table: Table) -> None:
    successor, reward, p = table.successor, table.reward, table.probability
    for name, rule, values, holds in (
            ('successor', f'a state in [0, {table.n_states - 1}]', successor,
             (0 <= successor) & (successor < table.n_states)),
            ('reward', f'a finite number of at most {LARGEST_REWARD:.0f}', reward,
             np.abs(reward) <= LARGEST_REWARD),
            ('probability', 'in (0, 1]', p, (0 < p) & (p <= 1 + TOLERANCE))):
        if not holds.all():
            k = int(np.flatnonzero(~holds)[0])
            raise MapError(f'a {name} must be {rule}, got {values[k]} in '
                           f'{_pair_text(table, int(table.pairs[k]))}')
    sums = np.bincount(table.pairs, p, minlength=len(table.first) - 1)
    wrong = np.flatnonzero((np.diff(table.first) > 0) & (np.abs(sums - 1.0) > TOLERANCE))
    if len(wrong):
        raise MapError('the probabilities of an action must add up to 1, got '
                       f'{sums[wrong[0]]:.12g} in {_pair_text(table, int(wrong[0]))}')


def _pair_text(table: Table, pair: int) -> str:
    s, a = divmod(pair, len(table.actions))
    return f'state {s}, action {table.actions[a]!r}'


def _check_starts(table: Table) -> None:
    if not table.starts:
        raise MapError('a world needs at least one start, got none')
    starts = np.array(table.starts)
    if starts.dtype.kind not in 'iu':
        raise MapError(f'a start must be the number of a state, got {table.starts!r:.80}')
    wrong = starts[(starts < 0) | (starts >= table.n_states)]
    if len(wrong):
        raise MapError(f'a start must be a state in [0, {table.n_states - 1}], got {wrong[0]}')
    wrong = starts[table.terminal[starts]]
    if len(wrong):
        raise MapError(f'a start must not be terminal, got state {wrong[0]}')


def _check_pictures(table: Table) -> None:
    positions, cells, states = table.positions, table.cells, table.n_states
    if positions is not None and (positions.shape != (states, 2)
                                  or positions.dtype != np.float64
                                  or not np.isfinite(positions).all()):
        raise MapError(f'positions must be finite numbers, float64 of shape ({states}, 2), got '
                       f'{positions.dtype} of shape {positions.shape}')
    if cells is not None and (len(cells) != states or not all(
            isinstance(cell, str) and len(cell) <= 1 for cell in cells)):
        raise MapError(f'cells must have a character or none for each of the {states} states')
