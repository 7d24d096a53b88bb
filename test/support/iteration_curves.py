# SPDX-License-Identifier: Apache-2.0
"""Curves over iterations, for tests."""

from comply_ros.protocol.iteration_curve import IterationCurve


def curve_of(*iterations):
    """Return a curve after these iterations, with their numbers as values."""
    curve = IterationCurve()
    for iteration in iterations:
        curve = curve.extended(iteration, float(iteration))
    return curve
