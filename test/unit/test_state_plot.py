# SPDX-License-Identifier: Apache-2.0
"""Pictures of worlds without a grid."""

from matplotlib.collections import PolyCollection
import numpy as np
import pytest
from tiny_tables import hall, machine

from comply_ros.plots.grid_plot import write_picture
from comply_ros.plots.state_plot import NOTHING_TO_SHOW, state_trust_figure
from comply_ros.plots.training_plots import trust_map_figure
from comply_ros.world.mdp import World

ADVICE = np.array([0, 2, -1], dtype=np.int8)
CONFIDENCE = np.array([0.75, 0.25, 0.0])
VISITED = np.array([True, False, False])
PLACES = np.array([[0.0, 0.0], [1.0, 0.5], [2.0, 0.0]])


def figure_of(table, advice=ADVICE, confidence=CONFIDENCE, visited=VISITED):
    """Return the figure of a table, and the axes of its states."""
    figure = state_trust_figure(World(table), 'title', advice, confidence, visited)
    return figure, figure.axes[0]


def heights(axes):
    """Return the heights of the bars."""
    bars = next(each for each in axes.collections if isinstance(each, PolyCollection))
    return [path.vertices[:, 1].max() for path in bars.get_paths()], bars.get_facecolor()


def texts(axes):
    """Return the texts in axes."""
    return [text.get_text() for text in axes.texts]


def test_every_state_with_advice_has_a_bar_as_high_as_the_confidence():
    _, axes = figure_of(machine())
    high, colors = heights(axes)
    assert high == pytest.approx([0.75, 0.25])
    assert [label.get_text() for label in axes.get_xticklabels()] == ['0 run', '1 repair']
    assert axes.get_ylabel() == 'confidence in the mentor'
    assert colors[0][1] > colors[0][0]  # green more than red
    assert colors[1].tolist() == pytest.approx([11 / 15, 11 / 15, 11 / 15, 1.0])  # never visited


def test_a_confidence_of_0_can_be_seen():
    _, axes = figure_of(machine(), confidence=np.zeros(3))
    assert min(heights(axes)[0]) > 0


def test_many_states_have_a_bar_each_and_few_labels():
    states = 400
    _, axes = figure_of(hall(states, 2), np.ones(states, dtype=np.int8), np.full(states, 0.5),
                        np.ones(states, dtype=bool))
    assert len(heights(axes)[0]) == states - 1  # the last one is terminal
    assert 10 < len(axes.get_xticks()) <= 30


def test_states_with_positions_are_points_in_their_places():
    _, axes = figure_of(machine(positions=PLACES))
    points = axes.collections[-1]
    assert points.get_offsets().tolist() == PLACES[:2].tolist()
    assert texts(axes) == ['run', 'repair']
    assert (axes.get_xlabel(), axes.get_ylabel()) == ('x (m)', 'y (m)')


def test_states_that_share_a_place_are_bars_so_that_none_hides_another():
    _, axes = figure_of(machine(positions=np.zeros((3, 2))))
    assert heights(axes)[0] == pytest.approx([0.75, 0.25])


@pytest.mark.parametrize('table', [machine(), machine(positions=PLACES)])
def test_without_advice_the_picture_says_so(tmp_path, table):
    figure, axes = figure_of(table, np.full(3, -1, dtype=np.int8))
    assert texts(axes) == [NOTHING_TO_SHOW]
    write_picture(figure, tmp_path / 'a.png')
    assert (tmp_path / 'a.png').stat().st_size > 1000


def test_a_trust_map_of_a_world_without_a_grid_is_drawn_by_states():
    summary = {'method': 'explicit', 'mentor': 'optimal'}
    figure = trust_map_figure(World(machine()), ADVICE, CONFIDENCE, VISITED, summary)
    assert heights(figure.axes[0])[0] == pytest.approx([0.75, 0.25])
