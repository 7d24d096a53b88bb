# SPDX-License-Identifier: Apache-2.0
"""The list of figures: all of the report's, with runs that can be and lines that differ."""

import pytest

from comply_ros.experiments import training_runs
from comply_ros.experiments.extra_figures import own_figures
from comply_ros.experiments.figure_plots import DRAWINGS
from comply_ros.experiments.plot_style import COLOURS, look_of
from comply_ros.experiments.published_results import NEAR
from comply_ros.experiments.report_figures import as_drawn, Mentors, report_figures
from comply_ros.learner.presets import METHODS

FIGURES = {profile: report_figures(profile, Mentors()) + own_figures(profile, Mentors())
           for profile in METHODS}


@pytest.mark.parametrize('profile', METHODS)
def test_every_figure_with_a_result_is_there_once(profile):
    expected = [f'{chapter}.{number}' for chapter, last in ((2, 10), (3, 10), (4, 22))
                for number in range(1, last + 1)]
    names = [figure.name for figure in FIGURES[profile]]
    assert names[:42] == expected
    assert len(set(names)) == len(names)


@pytest.mark.parametrize('profile', METHODS)
def test_every_figure_can_be_computed_and_drawn(profile):
    for figure in FIGURES[profile]:
        assert figure.kind in DRAWINGS or figure.kind == 'table'
        for run in figure.all_runs():
            training_runs.check_run(run)
            assert run.profile == profile or figure.name == 'text'


def test_a_method_has_one_colour_everywhere_and_lines_of_a_figure_differ():
    assert set(COLOURS) >= {'vanishing', 'beta_implicit', 'explicit', 'head_start'}
    for figure in FIGURES['published']:
        if figure.kind in ('curves', 'regrets', 'time_to_convergence'):
            labels = {label if isinstance(label, str) else label[0] for label in figure.runs}
            if not any('mentor' in label for label in labels):
                looks = {tuple(look_of(label).items()) for label in labels}
                assert len(looks) == len(labels), figure.name


def test_variants_keep_the_colour_of_their_method():
    for label in ('explicit, learned prior', 'explicit_lambda', 'explicit_off_policy'):
        assert look_of(label)['color'] == COLOURS['explicit']
        assert look_of(label)['linestyle'] != look_of('explicit')['linestyle']


def test_published_figures_are_of_the_maze_as_it_was_run():
    for profile, maze in (('published', 'maze_as_run'), ('report', 'maze')):
        figure = next(each for each in FIGURES[profile] if each.name == '4.14')
        assert {run.map for run in figure.runs.values()} == {maze}


def test_adaptive_learners_are_drawn_with_settings_that_lead_to_the_figures():
    run = as_drawn('beta_implicit', 'published', 'optimal')
    assert dict(run.settings) == NEAR['beta_implicit']
    assert as_drawn('beta_implicit', 'report', 'optimal').settings == ()
    assert as_drawn('vanishing', 'published', 'optimal').settings == ()
