# SPDX-License-Identifier: Apache-2.0
"""Verdicts are computed: with numbers made up, they turn."""

import numpy as np
import pytest

from comply_ros.experiments import figure_checks
from comply_ros.experiments.figure_checks import verdict
from comply_ros.experiments.report_figures import Mentors, report_figures
from comply_ros.experiments.result_cache import CellData
from comply_ros.experiments.results import Results

FIGURES = {figure.name: figure for figure in report_figures('published', Mentors())}


class Made(Results):
    """Results that were made up: one curve for every run, by its method."""

    def __init__(self, **curves):
        super().__init__(None, 'published')
        self.curves = curves

    def counted(self, run):
        """Return the curve of a run's method, the same for two seeds."""
        return np.tile(np.array(self.curves[run.method], dtype=float), (2, 1))

    def return_at(self, run, level):
        """Return a value between -70 (random) and 6 (optimal)."""
        return -70.0 + level * 76.0

    def measured(self, run, name):
        """Return the first value of the curve for every measure."""
        return [self.curves[run.method][0]] * 2

    def mentor_return(self, run):
        """Return what the mentor earns."""
        return 5.5


FLAT = [5.0] * 100
DIP = [5.0] * 20 + [-5.0] * 40 + [5.0] * 40
RISE = [-20.0] * 20 + [0.0] * 20 + [-6.0] * 40 + [5.0] * 40


def test_an_undershoot_is_how_far_the_curve_falls_below_its_beginning():
    assert Made(vanishing=DIP).undershoot(FIGURES['3.8'].all_runs()[0]) == 10.0
    assert Made(vanishing=FLAT).undershoot(FIGURES['3.8'].all_runs()[0]) == 0.0
    assert Made(vanishing=RISE).undershoot(FIGURES['3.8'].all_runs()[0]) == 6.0


@pytest.mark.parametrize('curve, agrees', [(DIP, True), (FLAT, False), ([-70.0] * 100, False)])
def test_vanishing_must_undershoot_and_come_back(curve, agrees):
    assert verdict(Made(vanishing=curve), FIGURES['3.8']).agrees == agrees


@pytest.mark.parametrize('curve, agrees', [(FLAT, True), (DIP, False)])
def test_an_adaptive_learner_must_not_undershoot(curve, agrees):
    made = Made(vanishing=DIP, explicit=curve)
    assert verdict(made, FIGURES['4.7']).agrees == agrees


@pytest.mark.parametrize('off, agrees', [(100.0, True), (300.0, False)])
def test_off_policy_must_be_better(off, agrees):
    made = Made(beta_implicit=[200.0], beta_implicit_off_policy=[off])
    assert verdict(made, FIGURES['4.21']) == (
        agrees, f'regret 200 on-policy, {off:.0f} off-policy')


@pytest.mark.parametrize('end, agrees', [(5.4, True), (3.0, False)])
def test_a_constant_learner_stays_with_its_mentor(end, agrees):
    assert verdict(Made(constant=[end] * 50), FIGURES['3.6']).agrees == agrees


def test_every_figure_of_the_report_with_a_result_has_a_verdict():
    for figure in FIGURES.values():
        judged = figure.name in figure_checks._BY_NAME or figure.kind in figure_checks._BY_KIND
        assert judged != (figure.kind in ('map', 'densities')), figure.name


class Trusting(Made):
    """Results of a learner that trusts half of the states, those on the left."""

    def cell(self, run):
        """Return confidence 0 on the right, 1 on the left."""
        x = np.arange(1681) % 41
        return CellData(None, None, None, (x < 20) * 1.0, np.ones(1681, dtype=bool), None)

    def wrong(self, run):
        """Return that the mentor is wrong on one side."""
        return (np.arange(1681) % 41 >= 20) == (self.curves['wrong'] == 'right')


@pytest.mark.parametrize('side, agrees', [('right', True), ('left', False)])
def test_wrong_recommendations_must_be_those_that_are_discarded(side, agrees):
    assert verdict(Trusting(wrong=side), FIGURES['4.5']).agrees == agrees


@pytest.mark.parametrize('worst, agrees', [((200.0, 220.0, 210.0), True),
                                           ((200.0, 400.0, 210.0), False)])
def test_times_must_grow_and_become_equal(worst, agrees):
    class Times(Made):
        def measured(self, run, name):
            """Return 1, 20, 120 with the best mentors, and what is given with the worst."""
            place = ('vanishing', 'beta_implicit', 'explicit').index(run.method)
            return [worst[place] if run.mentor == 'snapshot:0.5' else (120.0, 1.0, 20.0)[place]]
    assert verdict(Times(), FIGURES['4.15']).agrees == agrees
