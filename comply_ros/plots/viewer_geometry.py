# SPDX-License-Identifier: Apache-2.0
"""A grid world as points in metres, angles and percentages: what a viewer draws."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comply_ros.world.grid import NO_ACTION, STEPS
from comply_ros.world.mdp import World

UNKNOWN, FREE, OCCUPIED = -1, 0, 100  # cells of an occupancy grid, in percent
VALUE_SCALE = ('#f7fbff', '#2f7fb8')  # from the lowest value to the highest
# Points (x, y) of an arrow to the right, in cells from the center of its cell.
Shape = Sequence[tuple[float, float]]
ARROW_TRIANGLES: Shape = (
    (0.32, 0.0), (-0.26, 0.24), (-0.1, 0.0), (0.32, 0.0), (-0.1, 0.0), (-0.26, -0.24))
ARROW_LINES: Shape = (
    (-0.38, 0.0), (0.42, 0.0), (0.42, 0.0), (0.22, 0.14), (0.42, 0.0), (0.22, -0.14))
POINTS_PER_ARROW = 6


def cell_centers(states: ArrayLike, width: int, cell: float) -> NDArray[np.float64]:
    """
    `p[i]` = (x, y) of the center of the cell of `states[i]`, in metres.

    width: of the grid, in cells. cell: side of a cell, in metres.
    """
    states = np.asarray(states)
    return (np.stack((states % width, states // width), axis=-1) + 0.5) * cell


def arrow_points(states: ArrayLike, actions: ArrayLike, shape: Shape, width: int,
                 cell: float) -> NDArray[np.float64]:
    """`p[6 i + k]` = (x, y) of point k of a shape in `states[i]`, turned to `actions[i]`."""
    forward = np.array(STEPS, dtype=float)[np.asarray(actions, dtype=int)]
    left = np.stack((-forward[:, 1], forward[:, 0]), axis=-1)
    along, across = np.array(shape).T
    points = along[:, None] * forward[:, None] + across[:, None] * left[:, None]
    return (cell_centers(states, width, cell)[:, None] + points * cell).reshape(-1, 2)


def heading(s: int, s2: int, width: int) -> float | None:
    """Angle from s to s2 in radians, from the x axis towards y; None if they are the same."""
    dx, dy = s2 % width - s % width, s2 // width - s // width
    return float(np.arctan2(dy, dx)) if dx or dy else None


def occupancy(world: World) -> list[int]:
    """`o[s]`: 100 at an obstacle, 0 elsewhere."""
    return np.where(world.obstacle, OCCUPIED, FREE).tolist()


def trust_percent(world: World, confidence: ArrayLike) -> list[int]:
    """`o[s]`: confidence in percent, -1 where the learner never acts."""
    return np.where(world.free, percent(confidence), UNKNOWN).tolist()


def percent(shares: ArrayLike) -> NDArray[np.int64]:
    """Shares in [0, 1] as whole numbers of percent."""
    return np.rint(100.0 * np.asarray(shares, dtype=float)).astype(int)


def value_percent(world: World, values: ArrayLike) -> NDArray[np.int64]:
    """`v[i]`: the value of free state i, from 0 for the lowest to 100 for the highest."""
    free = np.asarray(values, dtype=float)[world.free]
    low, high = free.min(), free.max()
    return percent((free - low) / (high - low)) if high > low else np.full(len(free), 50)


def advised_states(world: World, policy: ArrayLike) -> NDArray[np.int64]:
    """States in which a learner can act and the policy has an action."""
    return np.flatnonzero(world.free & (np.asarray(policy) != NO_ACTION))
