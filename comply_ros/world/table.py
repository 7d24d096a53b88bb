# SPDX-License-Identifier: Apache-2.0
"""`Table`: a finite Markov decision process as a sparse table of outcomes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.grid import MapError


@dataclass(frozen=True)
class Table:
    """
    A finite MDP; with A actions, row `s * A + a` is action a in state s.

    Parameters
    ----------
    actions: the names of the actions.
    first: int64 `[states * A + 1]`: the outcomes of a row are `first[row]` to `first[row + 1]`;
        where there are none, the action does not exist in that state.
    successor, probability, reward: int32, float64, float64 `[k]`, one for each outcome.
    terminal: bool `[states]`.
    starts: the states in which an episode can start, equally likely.
    step_limit: number of steps after which an episode is truncated.
    positions: `(x, y)` of every state in metres, float64 `[states, 2]`, or None.
    cells: a text for every state, for drawing, or None.

    Raises
    ------
    MapError: naming the rule that is broken.

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
        states = len(self.terminal)
        if len(self.first) != states * len(self.actions) + 1:
            raise MapError(f'first must have {states * len(self.actions) + 1} numbers, '
                           f'got {len(self.first)}')
        if len(self.successor) and not 0 <= self.successor.min() <= self.successor.max() < states:
            raise MapError(f'a successor must be one of {states} states, '
                           f'got {self.successor.min()} to {self.successor.max()}')
        rows = np.flatnonzero(np.diff(self.first))
        if len(rows):
            sums = np.add.reduceat(self.probability, self.first[rows])
            worst = int(np.abs(sums - 1.0).argmax())
            if not abs(sums[worst] - 1.0) <= 1e-9:
                s, a = divmod(int(rows[worst]), len(self.actions))
                raise MapError('the probabilities of the outcomes of an action must sum to 1, '
                               f'got {sums[worst]} in state {s}, action {self.actions[a]}')
        if not self.starts:
            raise MapError('a map needs at least one start, got none')
