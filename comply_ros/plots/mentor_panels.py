# SPDX-License-Identifier: Apache-2.0
"""The confidence in each of several mentors as a picture: a panel for each of them."""

from collections.abc import Sequence
from math import ceil
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np
from numpy.typing import NDArray

from comply_ros.plots.grid_plot import (
    add_mark_legend,
    draw_cells,
    draw_trust,
    INK,
    LEGEND_ROOM,
    place_axes,
    set_title,
)
from comply_ros.plots.mentor_marks import NO_NAME
from comply_ros.plots.state_plot import add_scale, draw_state_trust
from comply_ros.storage.file_system import printable
from comply_ros.world.mdp import World

COLUMNS = 3  # of panels, at most
PANEL = 4.0  # inches: the longer side of a grid
STATES_PANEL = 4.2, 3.4  # (width, height) of any other world, in inches
# Inches around a panel: of a grid, and where there are numbers at its axes.
GRID_MARGIN, STATES_MARGIN = (0.15, 0.15), (0.9, 0.8)
TITLE, HEAD, SCALE = 0.35, 0.45, 1.1  # inches above a panel, above all, and right of all


def trust_panels(world: World, title: str, mentors: Sequence[str], advice: NDArray[Any],
                 confidence: NDArray[np.float64], visited: NDArray[np.bool_]) -> Figure:
    """
    Return a figure with a panel for each mentor, as `trust_figure` or `state_trust_figure` has it.

    mentors: names. advice, confidence: of each in rows, `advice[m * n_states + s]`.
    """
    is_grid = world.model == 'grid'
    figure, panels = _empty_panels(world, len(mentors))
    figure.suptitle(printable(title), x=0.15 / figure.get_figwidth(), ha='left', fontsize=11,
                    color=INK, parse_math=False)
    rows = zip(panels, mentors, advice.reshape(len(mentors), -1),
               confidence.reshape(len(mentors), -1))
    for axes, name, advised, trusted in rows:
        if is_grid:
            draw_cells(axes, world)
            draw_trust(axes, world, advised, trusted, visited)
        else:
            draw_state_trust(axes, world, advised, trusted, visited)
        set_title(axes, name or NO_NAME)
    add_scale(figure, panels[min(len(mentors), COLUMNS) - 1])
    add_mark_legend(figure, panels[0])
    return figure


def _empty_panels(world: World, count: int) -> tuple[Figure, list[Axes]]:
    """Return a figure with axes for so many mentors, row by row."""
    (width, height), (left, below) = STATES_PANEL, STATES_MARGIN
    if world.model == 'grid':
        cell = PANEL / max(world.grid.width, world.grid.height)
        (width, height), (left, below) = \
            (world.grid.width * cell, world.grid.height * cell), GRID_MARGIN
    columns, rows = min(count, COLUMNS), ceil(count / COLUMNS)
    wide, high = left + width, below + height + TITLE
    figure = Figure(figsize=(columns * wide + SCALE, rows * high + HEAD + LEGEND_ROOM))
    return figure, [
        place_axes(figure, m % columns * wide + left,
                   (rows - 1 - m // columns) * high + below + LEGEND_ROOM, width, height)
        for m in range(count)]
