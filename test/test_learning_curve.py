# SPDX-License-Identifier: Apache-2.0
"""The learning curve of the page."""

import pytest

from comply_ros.dashboard import learning_curve
from comply_ros.dashboard.curve_echart import bounds, curve_options, running_mean
from comply_ros.dashboard.learning_curve import Curve
from comply_ros.protocol.messages import Progress


def progress(iteration, mean_return=0.0):
    """Return a `Progress` without end."""
    return Progress(1, iteration, 0, 15, 100 * iteration, mean_return, 0.5, 1.0, False)


def grown(*iterations):
    """Return a curve after these iterations."""
    longer = Curve()
    for iteration in iterations:
        longer = longer.after(progress(iteration, float(iteration)))
    return longer


def test_an_iteration_that_is_said_again_replaces_what_came_after():
    assert grown(1, 2, 3, 2).iterations == (1, 2)
    assert grown(1, 2, 3, 1).returns == (1.0,)  # the learner was reset


def test_a_long_curve_is_thinned_and_keeps_its_newest_point(monkeypatch):
    monkeypatch.setattr(learning_curve, 'LONGEST', 10)
    longer = grown(*range(1, 101))
    assert len(longer.iterations) <= 10 and longer.iterations[-1] == 100
    assert longer.returns == tuple(map(float, longer.iterations))


def test_levels_are_lines_where_they_are_known():
    names = [line['name'] for line in curve_options(grown(1, 2), 5.84, None)['series']]
    assert names == ['each', 'learner', 'optimal 5.84']
    options = curve_options(Curve(), 5.84, -13.824)
    assert options['series'][-1]['data'] == [[1, -13.824], [10, -13.824]]


def test_the_axis_shows_levels_that_do_not_flatten_what_was_learned():
    assert bounds([1.0, 2.0, 4.0], [6.0]) == (0.0, 7.0)
    assert bounds([1.0, 2.0, 4.0], [6.0, -5.0])[0] == -6.0
    assert bounds([1.0, 2.0, 4.0], [6.0, -100.0])[0] == 0.0
    assert bounds([], []) == (-1.0, 2.0)


def test_a_few_first_iterations_do_not_flatten_the_rest():
    assert bounds([-500.0, *[1.0] * 39], [6.0])[0] == 0.0
    assert bounds([-36.0, *[1.0] * 4], [6.0])[0] == 0.0


@pytest.mark.parametrize('values, means', [
    ([], []), ([1.0, 3.0], [1.0, 3.0]), ([1.0] * 7 + [9.0] * 9, None)])
def test_the_running_mean_has_a_value_for_each_iteration(values, means):
    assert len(running_mean(values)) == len(values)
    assert means is None or running_mean(values) == means
