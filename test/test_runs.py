# SPDX-License-Identifier: Apache-2.0
"""One run asked for in plain values."""

import json
from threading import Event

import numpy as np
import pytest

from comply_ros.core.advising import MentorError
from comply_ros.core.grid import MapError
from comply_ros.core.method import MethodError
from comply_ros.experiments import runs, train
from comply_ros.experiments.runs import Run

SHORT = Run('bar_grid', 'published', 'explicit', (('iterations', 3), ('episodes', 4)),
            'noisy:0.3', seed=5)


def test_a_run_learns_what_train_learns(tmp_path):
    train.main(['train', '--map', 'bar_grid', '--method', 'explicit', '--mentor', 'noisy:0.3',
                '--iterations', '3', '--episodes', '4', '--seed', '5', '--out', str(tmp_path)])
    summary = json.loads((tmp_path / 'summary.json').read_text())
    learned = runs.learn(SHORT)
    assert (learned.digest, learned.returns, learned.steps) == (
        summary['digest'], summary['return_per_iteration'], summary['steps'])
    with np.load(tmp_path / 'learning.npz') as file:
        assert (file['q'] == learned.q).all()
        assert file['confidence'].tolist() == learned.confidence
    measured = runs.measures(SHORT, learned.returns)
    assert measured == {name: summary[name] for name in measured}


def test_settings_change_the_row_together():
    run = Run(method='beta_implicit', settings=(('trust', 'explicit'), ('trust_rate', 0.5)))
    assert (runs.row_of(run).trust, runs.row_of(run).trust_rate) == ('explicit', 0.5)


def test_the_largest_change_of_a_value_is_watched():
    learned = runs.learn(SHORT, watches_values=True)
    assert learned.changes[0] == 0.0  # the first iteration only measures
    assert all(change > 0.0 for change in learned.changes[1:])
    assert runs.learn(SHORT).changes == []


def test_a_run_that_is_stopped_comes_to_nothing():
    stop = Event()
    stop.set()
    assert runs.learn(SHORT, stop) is None


def test_measures_in_the_maze_compare_with_what_was_published():
    # `published`: the first iteration only measures; then 2 of 3 at or below 4.9; regret
    # (5.8386 - 4) + (5.8386 - 4.9) + (5.8386 - 5); ratio (4 + 4.9) / (2 * 5.8386).
    measured = runs.measures(Run(method='sarsa'), [-70.0, 4.0, 4.9, 5.0])
    assert measured['time_to_convergence'] == 2
    assert measured['regret'] == pytest.approx(3.6158)
    assert measured['reward_ratio'] == pytest.approx(0.7621690)


def test_regret_is_that_of_the_first_399_iterations():
    measured = runs.measures(Run(method='sarsa'), [0.0] + [5.8386] * 399 + [-100.0])
    assert measured['regret'] == pytest.approx(0.0)


@pytest.mark.parametrize('run, error', [
    (Run(map='attic'), MapError), (Run(method='sarse'), MethodError),
    (Run(mentor='good'), MentorError), (Run(budget=-1), MentorError),
    (Run(settings=(('speed', 1),)), MethodError),
    (Run(settings=(('iterations', 0),)), MethodError),
    (Run(settings=(('discount', 2.0),)), MethodError)])
def test_a_run_that_cannot_be_is_refused_before_it_begins(run, error):
    with pytest.raises(error):
        runs.check_run(run)


def test_a_mentor_with_nothing_to_say_has_no_return():
    assert runs.mentor_return(Run('bar_grid')) is None
    assert runs.mentor_return(Run('bar_grid', mentor='optimal')) == pytest.approx(
        runs.yardstick_of(Run('bar_grid')).optimal_return)
