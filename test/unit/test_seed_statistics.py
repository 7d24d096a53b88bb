# SPDX-License-Identifier: Apache-2.0
"""Bands and intervals over seeds."""

from math import isnan

import numpy as np
import pytest

from comply_ros.experiments.seed_statistics import band, interval, student_t


def test_a_band_holds_the_middle_of_the_seeds():
    low, high = band(np.arange(11.0)[:, None] * np.array([1.0, 10.0]))
    assert low.tolist() == [1.0, 10.0] and high.tolist() == [9.0, 90.0]


@pytest.mark.parametrize('freedom, t', [  # from printed tables
    (1, 12.706), (2, 4.303), (4, 2.776), (9, 2.262), (29, 2.045), (1000, 1.962)])
def test_the_quantiles_of_students_distribution(freedom, t):
    assert student_t(freedom) == pytest.approx(t, abs=0.001)


def test_an_interval_is_narrow_where_seeds_agree():
    assert interval([3.0, 3.0, 3.0]) == (3.0, 3.0, 3.0)
    assert interval([3.0]) == (3.0, 3.0, 3.0)
    mean, low, high = interval([1.0, 2.0, 3.0])  # 2 -+ 4.303 * 1 / sqrt(3)
    assert (mean, low, high) == (2.0, pytest.approx(-0.484, abs=0.01),
                                 pytest.approx(4.484, abs=0.01))


def test_an_interval_covers_the_true_mean_about_as_often_as_it_says():
    rng = np.random.default_rng(1)
    hits = [low <= 0.0 <= high for _, low, high in
            (interval(rng.normal(size=5)) for _ in range(2000))]
    assert 0.935 < np.mean(hits) < 0.965


def test_none_is_left_out():
    assert interval([None, 4.0]) == (4.0, 4.0, 4.0)
    assert all(isnan(each) for each in interval([None, None]))
