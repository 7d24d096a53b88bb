# SPDX-License-Identifier: Apache-2.0
"""Verdicts are computed: they change with invented numbers."""

import numpy as np
import pytest

from comply_ros.experiments import figure_checks
from comply_ros.experiments.computed_results import Results
from comply_ros.experiments.figure_checks import verdict
from comply_ros.experiments.report_figures import Mentors, report_figures
from comply_ros.experiments.result_cache import CellData

FIGURES = {figure.name: figure for figure in report_figures('published', Mentors())}


class Invented(Results):
    """Invented results: one curve for every run, by its method."""

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


FLAT = [5.0] * 100
DIP = [5.0] * 20 + [-5.0] * 40 + [5.0] * 40
RISE = [-20.0] * 20 + [0.0] * 20 + [-6.0] * 40 + [5.0] * 40


def test_an_undershoot_is_how_far_the_curve_falls_below_its_beginning():
    assert Invented(vanishing=DIP).undershoot(FIGURES['3.8'].all_runs()[0]) == 10.0
    assert Invented(vanishing=FLAT).undershoot(FIGURES['3.8'].all_runs()[0]) == 0.0
    assert Invented(vanishing=RISE).undershoot(FIGURES['3.8'].all_runs()[0]) == 6.0


@pytest.mark.parametrize('curve, agrees', [(DIP, True), (FLAT, False), ([-70.0] * 100, False)])
def test_vanishing_must_undershoot_and_recover(curve, agrees):
    assert verdict(Invented(vanishing=curve), FIGURES['3.8']).agrees == agrees


@pytest.mark.parametrize('curve, agrees', [(FLAT, True), (DIP, False)])
def test_an_adaptive_learner_must_not_undershoot(curve, agrees):
    results = Invented(vanishing=DIP, explicit=curve)
    assert verdict(results, FIGURES['4.7']).agrees == agrees


@pytest.mark.parametrize('off, agrees', [(100.0, True), (300.0, False)])
def test_off_policy_must_be_better(off, agrees):
    results = Invented(beta_implicit=[200.0], beta_implicit_off_policy=[off])
    assert verdict(results, FIGURES['4.21']) == (
        agrees, f'regret 200 on-policy, {off:.0f} off-policy')


@pytest.mark.parametrize('end, agrees', [(5.4, True), (3.0, False)])
def test_a_constant_learner_ends_at_the_return_of_its_mentor(monkeypatch, end, agrees):
    monkeypatch.setattr(figure_checks, 'mentor_return', lambda run: 5.5)
    assert verdict(Invented(constant=[end] * 50), FIGURES['3.6']).agrees == agrees


def test_every_figure_of_the_report_with_a_result_has_a_verdict():
    for figure in FIGURES.values():
        checked = (figure.name in figure_checks.CHECKS_BY_NAME
                   or figure.kind in figure_checks.CHECKS_BY_KIND)
        assert checked != (figure.kind in ('map', 'densities')), figure.name


class Trusting(Invented):
    """Results of a learner that trusts half of the states, those on the left."""

    def cell(self, run):
        """Return confidence 0 on the right, 1 on the left."""
        x = np.arange(1681) % 41
        return CellData(None, None, None, (x < 20) * 1.0, np.ones(1681, dtype=bool), None)

    def wrong(self, run):
        """Return that the mentor is wrong on one side."""
        return (np.arange(1681) % 41 >= 20) == (self.curves['wrong'] == 'right')


@pytest.mark.parametrize('side, agrees', [('right', True), ('left', False)])
def test_the_discarded_recommendations_must_be_the_wrong_ones(side, agrees):
    assert verdict(Trusting(wrong=side), FIGURES['4.5']).agrees == agrees


@pytest.mark.parametrize('worst, agrees', [((200.0, 220.0, 210.0), True),
                                           ((200.0, 400.0, 210.0), False)])
def test_times_must_grow_and_become_equal(worst, agrees):
    class Times(Invented):
        def measured(self, run, name):
            """Return 1, 20, 120 with the best mentors, and what is given with the worst."""
            place = ('vanishing', 'beta_implicit', 'explicit').index(run.method)
            return [worst[place] if run.mentor == 'snapshot:0.5' else (120.0, 1.0, 20.0)[place]]
    assert verdict(Times(), FIGURES['4.15']).agrees == agrees
