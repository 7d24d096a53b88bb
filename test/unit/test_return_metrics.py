# SPDX-License-Identifier: Apache-2.0
"""Time to convergence, reward ratio, regret: section 4.3.1."""

import pytest

from comply_ros.learner.return_metrics import regret, reward_ratio, threshold, time_to_convergence

RETURNS = [-2.0, 5.0, 4.0, 5.5, 5.0]


def test_thresholds_of_the_two_profiles():
    assert threshold('report', 5.8386) == pytest.approx(5.780214)  # 99 %
    assert threshold('published', 5.8386) == pytest.approx(4.9)
    assert threshold('report', -2.0) == pytest.approx(-2.02)  # below it, where it is negative


def test_the_report_wants_returns_that_stay_above_and_the_published_runs_count_them():
    assert time_to_convergence('report', RETURNS, 4.5) == 3
    assert time_to_convergence('published', RETURNS, 4.5) == 2
    assert time_to_convergence('report', RETURNS, 5.2) is None
    assert time_to_convergence('report', RETURNS, -3.0) == 0
    assert time_to_convergence('published', RETURNS, 4.0) == 2  # at the level is not above it
    assert time_to_convergence('report', RETURNS, 4.0) == 3
    assert time_to_convergence('published', RETURNS, -3.0) == 0


def test_the_reward_ratio_is_the_return_until_convergence_over_the_optimal_one():
    assert reward_ratio(RETURNS, 3, 5.0) == pytest.approx(7.0 / 15.0)
    assert reward_ratio(RETURNS, None, 5.0) == pytest.approx(17.5 / 25.0)
    assert reward_ratio(RETURNS, 0, 5.0) is None
    assert reward_ratio(RETURNS, 3, 0.0) is None


def test_regret_is_the_sum_of_what_is_missing_to_the_optimal_return():
    assert regret(RETURNS, 5.5) == pytest.approx(7.5 + 0.5 + 1.5 + 0.0 + 0.5)
