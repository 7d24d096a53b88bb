# SPDX-License-Identifier: Apache-2.0
"""The picture of the suite, from invented numbers."""

from math import isnan

from comply_ros.experiments.suite_plot import ratio, suite_figure
from comply_ros.experiments.suite_runs import MENTORS


def test_a_ratio_needs_a_regret_to_compare_with():
    assert ratio({'mean': 50.0}, {'mean': 40.0}) == 1.25
    assert isnan(ratio({'mean': 50.0}, {'mean': 0.4}))


def test_a_world_is_a_row_and_what_is_beyond_the_edge_is_a_triangle_at_it():
    regret = {'none': {'mean': 100.0}, **dict.fromkeys(MENTORS, {'mean': 75.0}),
              'random': {'mean': 900.0}, 'watkins': {'mean': 200.0}}
    figure = suite_figure([{'map': 'maze', 'held_out': False, 'best': 'watkins', 'regret': regret},
                           {'map': 'windy', 'held_out': True, 'best': 'watkins', 'regret': {
                               **regret, 'random': {'mean': 110.0}}}])
    left, right = figure.axes
    assert [label.get_text() for label in left.get_yticklabels()] == ['maze', 'windy *']
    points = {tuple(point) for dots in left.collections for point in dots.get_offsets().tolist()}
    assert points == {(0.75, 0.0), (0.75, 1.0), (3.0, 0.0), (1.1, 1.0)}
    assert {tuple(point) for dots in right.collections
            for point in dots.get_offsets().tolist()} == {(0.5, 0.0), (0.5, 1.0)}
    assert [line.get_xdata()[0] for line in (*left.lines, *right.lines)] == [1.25, 1.0]
