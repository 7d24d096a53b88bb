# SPDX-License-Identifier: Apache-2.0
"""
Where the states of a world that is no grid are drawn, and how its actions are: on page and viewer.

Where every state has a place of its own the cells are there, as on a map. Where states have no
place, or share one, the cells are in the order of the states, as in a table that is read by lines.
"""

from math import ceil, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from comply_ros.world.cell_rules import DIAGONAL, STAY
from comply_ros.world.grid import ACTION_NAMES, STEPS
from comply_ros.world.mdp import World

SPARSEST = 4  # a map has at most so many times more cells than states
SAME = 1e-4  # of the width of the world: coordinates that differ by less are the same
TOLERANCE = 0.1  # of a cell, by which a place may be off
# Step (x, y) of every action whose name is a direction; y is up.
DIRECTIONS = {**dict(zip(ACTION_NAMES, STEPS)), **DIAGONAL}
SIGNS = {'left': '\u2190', 'right': '\u2192', 'down': '\u2193', 'up': '\u2191',
         'up_left': '\u2196', 'up_right': '\u2197', 'down_left': '\u2199',
         'down_right': '\u2198', STAY: '\u2022'}
LONGEST_NAME = 4  # characters of a name that is its own sign
LONGEST_SIGN = 3  # characters of what is made of a longer one


class StateLayout(NamedTuple):
    """
    Where the cell of each state is.

    Attributes
    ----------
    columns, rows: of the picture.
    places: `places[s]`, int64: column and row, from the upper left.
    side: of a cell of a map, in metres; 1 where the places are not those of the world.
    is_map: whether the places are those of the world.

    """

    columns: int
    rows: int
    places: NDArray[np.int64]
    side: float
    is_map: bool


def layout_of(world: World) -> StateLayout:
    """Return where the states of a world are drawn."""
    on_map = _map_layout(world.positions)
    if on_map is not None:
        return on_map
    columns = ceil(sqrt(world.n_states))
    s = np.arange(world.n_states)
    return StateLayout(columns, ceil(world.n_states / columns),
                       np.stack((s % columns, s // columns), axis=1), 1.0, False)


def _map_layout(positions: NDArray[np.float64] | None) -> StateLayout | None:
    """Return column and row of each position, None unless they are cells of their own."""
    if positions is None or not are_distinct(positions):
        return None
    steps = np.concatenate([np.diff(np.unique(positions[:, k])) for k in range(2)])
    steps = steps[steps > SAME * np.ptp(positions, axis=0).max()]
    side = float(steps.min()) if len(steps) else 1.0
    exact = (positions - positions.min(axis=0)) / side
    places = np.rint(exact).astype(np.int64)
    if np.abs(exact - places).max() > TOLERANCE or not are_distinct(places):
        return None
    places[:, 1] = places[:, 1].max() - places[:, 1]  # y is up in the world, and down in pictures
    columns, rows = (places.max(axis=0) + 1).tolist()
    if columns * rows > SPARSEST * len(places) + 1:
        return None
    return StateLayout(columns, rows, places, side, True)


def are_distinct(places: NDArray[np.float64] | NDArray[np.int64]) -> bool:
    """Whether no two states are at one place, as those of a taxi with and without a passenger."""
    return len(np.unique(places, axis=0)) == len(places)


def goals_of(world: World) -> NDArray[np.bool_]:
    """Return which terminal states are goals: no other one earns more to enter."""
    if world.model == 'grid':
        return world.terminal
    entering = np.full(world.n_states, -np.inf)
    if world.model == 'table':
        np.maximum.at(entering, world.table.successor, world.table.reward)
    best = entering[world.terminal].max(initial=-np.inf)
    return world.terminal & (entering >= best)


def sign(name: str) -> str:
    """Return an action in a few characters: a direction as an arrow, others by `short_name`."""
    return SIGNS.get(name) or short_name(name)


def short_name(name: str) -> str:
    """Return an action in up to four of its letters, as RViz can write them: `pick_up` as `pu`."""
    if len(name) <= LONGEST_NAME:
        return name
    words = name.replace('_', ' ').split()
    if len(words) > 1:
        name = ''.join(word[0] for word in words)
    return name[:LONGEST_SIGN]
