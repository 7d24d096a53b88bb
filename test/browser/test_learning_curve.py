# SPDX-License-Identifier: Apache-2.0
"""The learning curve, and its chart on the page."""

from iteration_curves import curve_of
import pytest

from comply_ros.dashboard.curve_panel import bounds, chart_options
from comply_ros.plots.running_mean import running_mean
from comply_ros.protocol.iteration_curve import IterationCurve


def test_expected_returns_are_lines_where_they_are_known():
    names = [line['name'] for line in chart_options(curve_of(1, 2), 5.84, None)['series']]
    assert names == ['each', 'learner', 'optimal 5.84']
    options = chart_options(IterationCurve(), 5.84, -13.824)
    assert options['series'][-1]['data'] == [[1, -13.824], [10, -13.824]]


@pytest.mark.parametrize('iterations, visible', [((1,), True), ((1, 2), False)])
def test_the_point_of_a_single_iteration_is_visible(iterations, visible):
    each, learner = chart_options(curve_of(*iterations), None, None)['series']
    assert (each['showSymbol'], learner['showSymbol']) == (False, visible)


def test_the_axis_includes_the_newest_return_however_bad_it_is():
    assert bounds([25.0] * 9 + [20.0], [26.0])[0] == 19.0
    assert bounds([20.0] + [25.0] * 9, [26.0])[0] == 24.0


def test_the_axis_includes_expected_returns_that_do_not_flatten_the_curve():
    assert bounds([1.0, 2.0, 4.0], [6.0]) == (0.0, 7.0)
    assert bounds([1.0, 2.0, 4.0], [6.0, -5.0])[0] == -6.0
    assert bounds([1.0, 2.0, 4.0], [6.0, -100.0])[0] == 0.0
    assert bounds([], []) == (-1.0, 2.0)


def test_a_few_first_iterations_do_not_flatten_the_curve():
    assert bounds([-500.0, *[1.0] * 39], [6.0])[0] == 0.0
    assert bounds([-36.0, *[1.0] * 4], [6.0])[0] == 0.0


@pytest.mark.parametrize('values, means', [
    ([], []), ([1.0, 3.0], [1.0, 3.0]), ([1.0] * 7 + [9.0] * 9, None)])
def test_the_running_mean_has_a_value_for_each_iteration(values, means):
    assert len(running_mean(values)) == len(values)
    assert means is None or running_mean(values).tolist() == means


@pytest.mark.parametrize('returns, labelled', [((0.0, 20.0), False), ((1.0, 2.0), True)])
def test_the_ends_of_the_axis_have_labels_only_where_there_is_room(returns, labelled):
    curve = IterationCurve((1, 2), returns)
    label = chart_options(curve, None, None)['yAxis']['axisLabel']
    assert (label['showMinLabel'], label['showMaxLabel']) == (labelled, labelled)
