# SPDX-License-Identifier: Apache-2.0
"""Bands and intervals over seeds."""

from math import isnan

import numpy as np
import pytest

from comply_ros.experiments.statistics import band, interval


def test_a_band_holds_the_middle_of_the_seeds():
    low, high = band(np.arange(11.0)[:, None] * np.array([1.0, 10.0]))
    assert low.tolist() == [1.0, 10.0] and high.tolist() == [9.0, 90.0]


def test_an_interval_is_narrow_where_seeds_agree():
    assert interval([3.0, 3.0, 3.0]) == (3.0, 3.0, 3.0)
    mean, low, high = interval([1.0, 2.0, 3.0])
    assert (mean, low, high) == (2.0, pytest.approx(1.0, abs=0.4), pytest.approx(3.0, abs=0.4))
    assert interval([1.0, 2.0, 3.0]) == (mean, low, high)  # the same every time


def test_an_interval_covers_the_true_mean_about_as_often_as_it_says():
    rng = np.random.default_rng(1)
    hits = [low <= 0.0 <= high for _, low, high in
            (interval(rng.normal(size=30)) for _ in range(200))]
    assert 0.88 < np.mean(hits) < 0.99


def test_what_has_no_number_is_left_out():
    assert interval([None, 4.0]) == (4.0, 4.0, 4.0)
    assert all(isnan(each) for each in interval([None, None]))
