# SPDX-License-Identifier: Apache-2.0
"""The list of figures: all of the report's, with valid runs and lines that differ."""

import pytest

from comply_ros.experiments import training_runs
from comply_ros.experiments.figure_plots import PLOTS
from comply_ros.experiments.figures_beyond_report import extra_figures
from comply_ros.experiments.line_styles import COLOURS, line_style
from comply_ros.experiments.published_results import FITTED_SETTINGS
from comply_ros.experiments.report_figures import fitted_run, Mentors, report_figures
from comply_ros.learner.presets import METHODS

FIGURES = {profile: report_figures(profile, Mentors()) + extra_figures(profile, Mentors())
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
        assert figure.kind in PLOTS or figure.kind == 'table'
        for run in figure.all_runs():
            training_runs.validate_run(run)
            assert run.profile == profile or figure.name == 'text'


def test_a_method_has_one_colour_everywhere_and_lines_of_a_figure_differ():
    assert set(COLOURS) >= {'vanishing', 'beta_implicit', 'explicit', 'head_start'}
    for figure in FIGURES['published']:
        if figure.kind in ('curves', 'regrets', 'time_to_convergence'):
            labels = {label if isinstance(label, str) else label[0] for label in figure.runs}
            if not any('mentor' in label for label in labels):
                styles = {tuple(line_style(label).items()) for label in labels}
                assert len(styles) == len(labels), figure.name


def test_variants_keep_the_colour_of_their_method():
    for label in ('explicit, learned prior', 'explicit_lambda', 'explicit_off_policy'):
        assert line_style(label)['color'] == COLOURS['explicit']
        assert line_style(label)['linestyle'] != line_style('explicit')['linestyle']


def test_published_figures_are_of_the_maze_as_it_was_run():
    for profile, maze in (('published', 'maze_as_run'), ('report', 'maze')):
        figure = next(each for each in FIGURES[profile] if each.name == '4.14')
        assert {run.map for run in figure.runs.values()} == {maze}


def test_adaptive_learners_have_the_fitted_settings():
    run = fitted_run('beta_implicit', 'published', 'optimal')
    assert dict(run.settings) == FITTED_SETTINGS['beta_implicit']
    assert fitted_run('beta_implicit', 'report', 'optimal').settings == ()
    assert fitted_run('vanishing', 'published', 'optimal').settings == ()
