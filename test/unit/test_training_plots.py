# SPDX-License-Identifier: Apache-2.0
"""The pictures of a training: legends that cover nothing and explain everything."""

import numpy as np
import pytest
from tiny_worlds import grid

from comply_ros.plots.grid_plot import OBSTACLE, PALE
from comply_ros.plots.mentor_marks import mentor_color
from comply_ros.plots.training_plots import (
    confidence_figure,
    episode_lengths_figure,
    learning_curve_figure,
    trust_map_figure,
)
from comply_ros.protocol.messages import Episode
from comply_ros.world.mdp import World

SUMMARY = {'method': 'sarsa', 'map': 'maze', 'mentor': 'optimal', 'episodes': 15,
           'optimal_return': -1234.5, 'mentor_return': -2345.6}
SEVERAL = {**SUMMARY, 'mentor_returns': {'anna': -2345.6, 'bob': -3.0},
           'best_of_mentors_return': -1234.6}


def legend_of(figure):
    """Return the texts of the only legend of a figure."""
    legend, = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def episode(steps, truncated):
    """Return an episode of so many steps."""
    return Episode._make([0] * len(Episode._fields))._replace(steps=steps, truncated=truncated)


CURVES = {f'mentor_{m}': (range(1, 101), np.full(100, m / 16)) for m in range(16)}


@pytest.mark.parametrize('figure', [
    confidence_figure(CURVES, SUMMARY),
    confidence_figure({'': CURVES['mentor_1']}, SUMMARY),
    learning_curve_figure(np.zeros((1, 100)), SUMMARY),
    learning_curve_figure(np.zeros((5, 100)), SEVERAL),
    episode_lengths_figure([episode(500, True), episode(3, False)] * 50, 500, SUMMARY),
    trust_map_figure(World(grid('.#G', '...')), np.full(6, -1, np.int8), np.zeros(6),
                     np.ones(6, bool), SUMMARY)])
def test_a_legend_is_in_the_picture_and_covers_nothing(figure):
    figure.canvas.draw()
    legend = figure.legends[0].get_window_extent()
    assert not any(legend.overlaps(axes.get_tightbbox()) for axes in figure.axes)
    assert figure.bbox.x0 <= legend.x0 and legend.x1 <= figure.bbox.x1
    assert figure.bbox.y0 <= legend.y0


@pytest.mark.parametrize('iterations, texts', [
    (15, ['learner']),
    (100, ['learner, each iteration', 'learner, running mean of 9 iterations'])])
def test_the_legend_says_which_line_is_a_running_mean(iterations, texts):
    figure = learning_curve_figure(np.zeros((1, iterations)), SUMMARY)
    assert legend_of(figure) == [*texts, 'optimal (-1234.50)', 'mentor (-2345.60)']


def test_each_mentor_has_a_line_of_its_confidence_in_its_color():
    figure = confidence_figure({'anna': ((1, 2, 3), (0.5, np.nan, 0.75)), '': ((3,), (0.25,))},
                               SUMMARY)
    axes, = figure.axes
    anna, other = axes.lines
    assert (anna.get_color(), other.get_color()) == (mentor_color(0), mentor_color(1))
    assert anna.get_ydata()[[0, 2]].tolist() == [0.5, 0.75] and other.get_marker() == '.'
    assert legend_of(figure) == ['anna', 'without a name']
    assert (axes.get_xlim(), axes.get_ylim()) == ((1.0, 3.0), (-0.02, 1.02))


def test_the_legend_of_a_trust_map_names_what_is_in_the_cells_and_no_more():
    def legend(*rows):
        return legend_of(trust_map_figure(World(grid(*rows)), np.full(6, -1, np.int8), np.zeros(6),
                                          np.ones(6, bool), SUMMARY))
    assert legend('.#G', '...') == ['goal', 'start', 'obstacle']
    assert legend('..G', '...') == ['goal', 'start']


def test_all_of_the_trust_map_of_a_narrow_map_is_in_the_picture():
    rows = ('G', *20 * ['.'])
    figure = trust_map_figure(World(grid(*rows)), np.full(21, -1, np.int8), np.zeros(21),
                              np.ones(21, bool), {**SUMMARY, 'method': 'beta_implicit'})
    figure.canvas.draw()
    axes, bar = figure.axes[0], figure.axes[0].child_axes[0]
    for part in (axes, bar, figure.legends[0]):
        assert part.get_tightbbox().x1 <= figure.bbox.x1
    assert bar.get_window_extent().width == pytest.approx(0.2 * figure.dpi)
    assert bar.get_window_extent().x0 > axes.get_window_extent().x1


def test_obstacles_are_much_darker_than_arrows_in_states_never_visited():
    assert int(OBSTACLE[1], 16) + 4 < int(PALE[1], 16)
