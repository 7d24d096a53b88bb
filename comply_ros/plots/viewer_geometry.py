# SPDX-License-Identifier: Apache-2.0
"""A world as points in metres, angles and percentages: what a viewer draws."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comply_ros.plots.state_layout import are_distinct, DIRECTIONS, layout_of
from comply_ros.world.grid import NO_ACTION
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

Points = NDArray[np.float64]  # `p[i]` = (x, y) in metres
States = NDArray[np.int64]


class StatePlaces(NamedTuple):
    """
    Where the states of a world are, in metres.

    Attributes
    ----------
    columns, rows: cells of the picture.
    side: of a cell.
    corner: (x, y), the lower left one of the picture.
    positions: `positions[s]`: (x, y) of each state; None where state s is in cell s, counted by
        rows: of a map from the lower left on, else from the upper left on, as in a table.
    cells: `cells[s]`: where state s is in an `OccupancyGrid`; None for cell s.
    is_map: whether the picture is a map of cells.

    """

    columns: int
    rows: int
    side: float
    corner: tuple[float, float]
    positions: Points | None = None
    cells: States | None = None
    is_map: bool = False

    @property
    def are_scattered(self) -> bool:
        """Whether states have places in the world that are no cells."""
        return self.positions is not None and not self.is_map

    @property
    def are_a_table(self) -> bool:
        """Whether states are in their order, and directions mean nothing."""
        return self.positions is None and not self.is_map

    def centers(self, states: ArrayLike) -> Points:
        """`p[i]` = (x, y) of the place of `states[i]`."""
        states = np.asarray(states, dtype=np.int64)
        if self.positions is not None:
            return self.positions[states]
        row = states // self.columns
        row = row if self.is_map else self.rows - 1 - row
        return (np.stack((states % self.columns, row), axis=-1) + 0.5) * self.side + self.corner


def places_of(world: World, cell: float) -> StatePlaces:
    """
    Return where the states of a world are.

    Those with positions that differ are there. The others are in cells, as in a table.

    cell: side of a cell in metres, of a world that does not say where its states are.
    """
    if world.model == 'grid':
        return StatePlaces(world.grid.width, world.grid.height, cell, (0.0, 0.0), is_map=True)
    layout, positions = layout_of(world), world.positions
    if positions is None or not (layout.is_map or are_distinct(positions)):
        return StatePlaces(layout.columns, layout.rows, cell, (0.0, 0.0))
    if not layout.is_map:
        return _scattered(positions)
    column, row = layout.places.T
    cells = (layout.rows - 1 - row) * layout.columns + column
    return StatePlaces(layout.columns, layout.rows, layout.side,
                       _corner(positions, layout.side), positions, cells, True)


def _scattered(positions: Points) -> StatePlaces:
    """Return places that are no cells; the side is that of cells spread evenly over the area."""
    width, height = np.ptp(positions, axis=0).tolist()
    narrowest = max(width, height) / len(positions)
    side = float(np.sqrt(max(width, narrowest) * max(height, narrowest) / len(positions)))
    return StatePlaces(int(np.ceil(width / side)) + 1, int(np.ceil(height / side)) + 1, side,
                       _corner(positions, side), positions)


def _corner(positions: Points, side: float) -> tuple[float, float]:
    x, y = (positions.min(axis=0) - side / 2).tolist()
    return x, y


def arrow_points(centers: Points, names: Sequence[str], shape: Shape, side: float) -> Points:
    """
    `p[6 i + k]` = (x, y) of point k of a shape at `centers[i]`, turned to `names[i]`.

    names: of actions, each a direction. side: of a cell in metres.
    """
    steps = np.array([DIRECTIONS[name] for name in names], dtype=float).reshape(-1, 2)
    forward = steps / np.hypot(*steps.T)[:, None]
    left = np.stack((-forward[:, 1], forward[:, 0]), axis=-1)
    along, across = np.array(shape).T
    points = along[:, None] * forward[:, None] + across[:, None] * left[:, None]
    return (centers[:, None] + points * side).reshape(-1, 2)


def heading(here: ArrayLike, there: ArrayLike) -> float | None:
    """Angle from a point to another in radians, from x towards y; None if they are the same."""
    dx, dy = (np.asarray(there, dtype=float) - np.asarray(here, dtype=float)).tolist()
    return float(np.arctan2(dy, dx)) if dx or dy else None


def occupancy(world: World, places: StatePlaces) -> list[int]:
    """`o[cell]`: 100 at an obstacle or where nobody can be, -1 where no state is, 0 elsewhere."""
    blocked = world.obstacle if world.model == 'grid' else ~(world.free | world.terminal)
    return _in_cells(np.where(blocked, OCCUPIED, FREE), places)


def trust_percent(world: World, places: StatePlaces, confidence: ArrayLike) -> list[int]:
    """`o[cell]`: confidence in percent, -1 where the learner never acts."""
    return _in_cells(np.where(world.free, percent(confidence), UNKNOWN), places)


def _in_cells(shown: NDArray[np.int64], places: StatePlaces) -> list[int]:
    if places.cells is None:
        return shown.tolist()
    cells = np.full(places.columns * places.rows, UNKNOWN)
    cells[places.cells] = shown
    return cells.tolist()


def percent(shares: ArrayLike) -> NDArray[np.int64]:
    """Shares in [0, 1] as whole numbers of percent."""
    return np.rint(100.0 * np.asarray(shares, dtype=float)).astype(int)


def value_percent(world: World, values: ArrayLike) -> NDArray[np.int64]:
    """`v[i]`: the value of free state i, from 0 for the lowest to 100 for the highest."""
    halves = np.asarray(values, dtype=float)[world.free] / 2.0  # whose differences are finite
    low, high = halves.min(), halves.max()
    return percent((halves - low) / (high - low)) if high > low else np.full(len(halves), 50)


def advised_states(world: World, policy: ArrayLike) -> States:
    """States in which a learner can act and the policy has an action."""
    return np.flatnonzero(world.free & (np.asarray(policy) != NO_ACTION))


def arrow_and_name_states(world: World, policy: NDArray[np.integer]) -> tuple[States, States]:
    """Advised states in which the action is a direction, and those in which it is another."""
    states = advised_states(world, policy)
    is_direction = np.array([name in DIRECTIONS for name in world.action_names])
    turned = is_direction[policy[states]]
    return states[turned], states[~turned]
