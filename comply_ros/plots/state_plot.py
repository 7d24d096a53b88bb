# SPDX-License-Identifier: Apache-2.0
"""Worlds without a grid as pictures: the confidence in every state, in bars, points or cells."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
import numpy as np
from numpy.typing import NDArray

from comply_ros.plots.grid_plot import add_mark_legend, INK, LAST, LEGEND_ROOM, PALE, place_axes
from comply_ros.plots.map_plot import draw_map, has_cells
from comply_ros.plots.state_layout import are_distinct
from comply_ros.plots.trust_colors import TRUST_ANCHORS
from comply_ros.storage.file_system import printable
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World

SIZE = 8.0, 4.5  # of a picture, in inches
MOST_NAMED = 30  # states whose advice is written beside them
CONFIDENCE = 'confidence in the mentor'
NOTHING_TO_SHOW = 'the mentor has no advice in any state'


def state_trust_figure(world: World, title: str, advice: NDArray[Any],
                       confidence: NDArray[np.float64], visited: NDArray[np.bool_]) -> Figure:
    """
    Return a figure of the `confidence[s]` in `advice[s]` in a world without a grid.

    Cells of a map have arrows as in a grid. Other states that have a place each are points there,
    and those without one bars in their order. All are grey where the learner has never been, by
    `visited[s]`.
    """
    figure = Figure(figsize=(SIZE[0], SIZE[1] + LEGEND_ROOM))
    axes = place_axes(figure, 0.9, 0.7 + LEGEND_ROOM, SIZE[0] - 1.9, SIZE[1] - 1.2)
    figure.suptitle(printable(title), x=0.04, ha='left', fontsize=11, color=INK,
                    parse_math=False)
    draw_state_trust(axes, world, advice, confidence, visited)
    add_scale(figure, axes)
    add_mark_legend(figure, axes)
    return figure


def draw_state_trust(axes: Axes, world: World, advice: NDArray[Any],
                     confidence: NDArray[np.float64], visited: NDArray[np.bool_]) -> None:
    """Draw what a `state_trust_figure` shows."""
    axes.spines[['top', 'right']].set_visible(False)
    states = np.flatnonzero(world.free & (advice != NO_ACTION))
    colors = LinearSegmentedColormap.from_list('trust', TRUST_ANCHORS)(confidence[states])
    colors[~visited[states]] = [*np.full(3, int(PALE[1], 16) / 15), 1.0]
    names = [printable(world.action_names[a]) for a in advice[states].tolist()]
    positions = world.positions
    if positions is not None and are_distinct(positions[world.free]):
        draw = draw_map if has_cells(world) else _draw_points
        draw(axes, world, positions, states, colors, names)
        axes.set(xlabel='x (m)', ylabel='y (m)', aspect='equal')
    else:
        _draw_bars(axes, states, confidence[states], colors, names)
    if not len(states):
        axes.text(0.5, 0.5, NOTHING_TO_SHOW, transform=axes.transAxes, ha='center', color=INK)


def _draw_bars(axes: Axes, states: NDArray[np.intp], confidence: NDArray[np.float64],
               colors: NDArray[np.float64], names: list[str]) -> None:
    """Draw a bar for each of the states; all of them stay visible, however many they are."""
    places = np.arange(len(states))
    left, right, top = places - 0.4, places + 0.4, np.maximum(confidence, 0.01)
    low = np.zeros(len(states))
    corners = np.stack((np.stack((left, low), 1), np.stack((right, low), 1),
                        np.stack((right, top), 1), np.stack((left, top), 1)), 1)
    axes.add_collection(PolyCollection(list(corners), facecolors=colors, edgecolors=colors,
                                       linewidth=0.5))
    axes.set(xlim=(-1, max(len(states), 1)), ylim=(0, 1.02), ylabel=CONFIDENCE, xlabel='state')
    shown = places[::max(1, -(-len(places) // MOST_NAMED))]
    labels = [str(states[i]) for i in shown]
    if len(states) <= MOST_NAMED:
        labels = [f'{label} {name}' for label, name in zip(labels, names)]
        axes.set_xlabel('state, and the advice in it')
    axes.set_xticks(shown, labels, rotation=90, fontsize=7, parse_math=False)


def _draw_points(axes: Axes, world: World, positions: NDArray[np.float64],
                 states: NDArray[np.intp], colors: NDArray[np.float64], names: list[str]) -> None:
    """Draw a point for each of the states at its place, over pale ones for all states."""
    axes.scatter(*positions.T, s=14, color='#ddd', linewidth=0)
    axes.scatter(*positions[world.terminal].T, s=70, marker='*', color=INK, linewidth=0,
                 label=LAST if world.terminal.any() else None)
    axes.scatter(*positions[states].T, s=60, color=colors, linewidth=0)
    if len(states) <= MOST_NAMED:
        for s, name in zip(states, names):
            axes.annotate(name, positions[s], textcoords='offset points', xytext=(0, 7),
                          ha='center', fontsize=7, parse_math=False)
    axes.margins(0.1)


def add_scale(figure: Figure, axes: Axes) -> None:
    """Draw the scale of colors to the right."""
    colors = LinearSegmentedColormap.from_list('trust', TRUST_ANCHORS)
    bar = figure.colorbar(ScalarMappable(cmap=colors), cax=axes.inset_axes((1.03, 0.2, 0.02, 0.6)))
    bar.set_label(CONFIDENCE, color=INK)
    bar.outline.set_visible(False)
