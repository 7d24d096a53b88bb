# SPDX-License-Identifier: Apache-2.0
"""A number for each iteration: begun again after a reset, thinned out when it is long."""

from math import nan

from iteration_curves import curve_of
import pytest

from comply_ros.protocol.iteration_curve import IterationCurve, MAX_POINTS


def test_an_iteration_that_is_reported_again_replaces_those_from_it_on():
    assert curve_of(1, 2, 3, 2) == IterationCurve((1, 2), (1.0, 2.0))
    assert curve_of(1, 2, 3, 1) == IterationCurve((1,), (1.0,))  # the learner was reset


def test_a_long_curve_loses_every_second_point_but_never_the_newest():
    curve = IterationCurve()
    for iteration in range(1, 3 * MAX_POINTS):
        curve = curve.extended(iteration, float(iteration))
        assert len(curve.iterations) <= MAX_POINTS and curve.iterations[-1] == iteration
    assert len(curve.iterations) > MAX_POINTS // 4
    assert curve.values == tuple(map(float, curve.iterations))


def test_one_curve_goes_on_as_another():
    later = IterationCurve((3, 4), (0.5, 0.5))
    assert curve_of(1, 2, 3).followed_by(later) == IterationCurve((1, 2, 3, 4), (1, 2, 0.5, 0.5))
    assert curve_of(1, 2).followed_by(IterationCurve()) == curve_of(1, 2)


@pytest.mark.parametrize('values, lone', [
    ((), False), ((0.5,), True), ((0.5, 0.5), False), ((0.5, nan, 0.6, 0.7), True),
    ((nan, 0.6, 0.7, nan), False), ((nan, 0.6, nan), True), ((nan,), False)])
def test_a_number_without_one_beside_it_is_a_lone_point(values, lone):
    assert IterationCurve(tuple(range(1, 1 + len(values))), values).has_lone_points is lone


def test_a_curve_of_nothing_but_nan_is_not_known():
    assert not IterationCurve().is_known and not IterationCurve((1,), (nan,)).is_known
    assert IterationCurve((1, 2), (nan, 0.0)).is_known
