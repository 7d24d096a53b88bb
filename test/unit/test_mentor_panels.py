# SPDX-License-Identifier: Apache-2.0
"""The picture of the confidence in several mentors."""

from matplotlib.quiver import Quiver
import numpy as np
import pytest
from tiny_tables import machine
from tiny_worlds import grid

from comply_ros.plots.grid_plot import write_picture
from comply_ros.plots.training_plots import trust_map_figure
from comply_ros.world.mdp import World

SUMMARY = {'method': 'explicit', 'mentor': 'as recorded'}


def figure_of(source, names, advice, confidence, visited):
    """Return the figure of mentors whose rows of advice and confidence follow each other."""
    return trust_map_figure(World(source), np.array(advice, dtype=np.int8), np.array(confidence),
                            np.array(visited), SUMMARY, names)


def panels(figure):
    """Return the axes with a mentor's name in a figure, by that name."""
    return {axes.get_title(loc='left'): axes for axes in figure.axes if axes.get_title(loc='left')}


def test_each_mentor_has_a_panel_with_its_arrows_in_the_colors_of_its_confidence():
    figure = figure_of(grid('..G'), ['anna', 'bob'], [1, 1, -1, -1, 0, -1],
                       [0.75, 0.5, 0.0, 0.0, 0.25, 0.0], [True, True, False])
    assert figure.get_suptitle() == \
        'Where explicit follows each of its mentors; grey: never visited'
    drawn = {name: [each for each in axes.collections if isinstance(each, Quiver)]
             for name, axes in panels(figure).items()}
    assert list(drawn) == ['anna', 'bob']
    assert drawn['anna'][-1].get_array().tolist() == [0.75, 0.5]
    assert drawn['bob'][-1].get_array().tolist() == [0.25]


def test_panels_of_a_world_without_a_grid_have_its_states(tmp_path):
    figure = figure_of(machine(), ['anna', ''], [0, 2, -1, -1, 0, -1],
                       [0.75, 0.5, 0.0, 0.0, 0.25, 0.0], [True, True, False])
    shown = panels(figure)
    assert list(shown) == ['anna', 'without a name']
    assert len(shown['anna'].get_xticks()) == 2 and len(shown['without a name'].get_xticks()) == 1
    write_picture(figure, tmp_path / 'a.png')
    assert (tmp_path / 'a.png').stat().st_size > 1000


@pytest.mark.parametrize('count, columns, rows', [(2, 2, 1), (3, 3, 1), (4, 3, 2), (7, 3, 3)])
def test_many_mentors_have_several_rows_of_panels_and_none_covers_another(count, columns, rows):
    figure = figure_of(grid('..G'), [f'm{m}' for m in range(count)], count * [1, 1, -1],
                       count * [0.5, 0.5, 0.0], [True, True, False])
    boxes = [axes.get_position() for axes in panels(figure).values()]
    assert len({round(box.x0, 6) for box in boxes}) == columns
    assert len({round(box.y0, 6) for box in boxes}) == rows
    assert not any(one.overlaps(other) for one in boxes for other in boxes if one is not other)


def test_the_only_mentor_has_the_whole_picture_whatever_its_name():
    figure = figure_of(grid('..G'), ['anna'], [1, 1, -1], [0.75, 0.5, 0.0], [True, True, False])
    assert figure.axes[0].get_title(loc='left').startswith('Where explicit follows its mentor')
