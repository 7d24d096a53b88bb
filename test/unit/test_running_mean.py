# SPDX-License-Identifier: Apache-2.0
"""The smooth line of a learning curve."""

import pytest

from comply_ros.plots.running_mean import running_mean


@pytest.mark.parametrize('values', [[], [1.0, 3.0], [1.0] * 7 + [9.0] * 9])
def test_there_is_a_mean_for_each_value(values):
    assert running_mean(values).shape == (len(values),)


def test_few_values_are_their_own_means():
    assert running_mean([1.0, 3.0]).tolist() == [1.0, 3.0]


def test_the_window_is_centered_and_cut_at_both_ends():
    means = running_mean([0.0] * 8 + [6.0] + [0.0] * 7)  # of 16 values: a window of 3
    assert means[6:11].tolist() == [0.0, 2.0, 2.0, 2.0, 0.0]
    assert running_mean([4.0, 2.0] + [0.0] * 14)[0] == 3.0


def test_a_window_has_at_most_nine_values():
    assert running_mean([0.0] * 100 + [9.0] + [0.0] * 100).tolist().count(1.0) == 9
