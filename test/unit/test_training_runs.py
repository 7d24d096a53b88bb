# SPDX-License-Identifier: Apache-2.0
"""One run described by plain values."""

import json
from threading import Event

import numpy as np
import pytest

from comply_ros.experiments import train, training_runs
from comply_ros.experiments.training_runs import Run
from comply_ros.learner.learner_config import ConfigError
from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.world.grid import MapError

SHORT = Run('bar_grid', 'published', 'explicit', (('iterations', 3), ('episodes', 4)),
            'noisy:0.3', seed=5)


def test_a_run_learns_what_train_learns(tmp_path):
    train.main(['train', '--map', 'bar_grid', '--method', 'explicit', '--mentor', 'noisy:0.3',
                '--iterations', '3', '--episodes', '4', '--seed', '5', '--out', str(tmp_path)])
    summary = json.loads((tmp_path / 'summary.json').read_text())
    assert summary['step_limit'] == 320  # of the map
    learned = training_runs.learn(SHORT)
    assert (learned.digest, learned.returns, learned.steps) == (
        summary['digest'], summary['return_per_iteration'], summary['steps'])
    with np.load(tmp_path / 'learning.npz') as file:
        assert (file['q'] == learned.q).all()
        assert file['confidence'].tolist() == learned.confidence
    measured = training_runs.measures(SHORT, learned.returns)
    assert measured == {name: summary[name] for name in measured}


def test_settings_are_validated_together():
    run = Run(method='beta_implicit', settings=(('trust', 'explicit'), ('trust_rate', 0.5)))
    config = training_runs.config_of(run)
    assert (config.trust, config.trust_rate) == ('explicit', 0.5)


def test_the_largest_change_of_a_value_is_recorded():
    learned = training_runs.learn(SHORT, watches_values=True)
    assert learned.changes[0] == 0.0  # the first iteration only measures
    assert all(change > 0.0 for change in learned.changes[1:])
    assert training_runs.learn(SHORT).changes == []


def test_a_stopped_run_has_no_result():
    stop = Event()
    stop.set()
    assert training_runs.learn(SHORT, stop) is None


def test_measures_in_the_maze_compare_with_what_was_published():
    # `published`: the first iteration only measures; then 2 of 3 at or below 4.9; regret
    # (5.8386 - 4) + (5.8386 - 4.9) + (5.8386 - 5); ratio (4 + 4.9) / (2 * 5.8386).
    measured = training_runs.measures(Run(method='sarsa'), [-70.0, 4.0, 4.9, 5.0])
    assert measured['time_to_convergence'] == 2
    assert measured['regret'] == pytest.approx(3.6158)
    assert measured['reward_ratio'] == pytest.approx(0.7621690)


def test_regret_is_that_of_the_first_399_iterations():
    measured = training_runs.measures(Run(method='sarsa'), [0.0] + [5.8386] * 399 + [-100.0])
    assert measured['regret'] == pytest.approx(0.0)


@pytest.mark.parametrize('run, error', [
    (Run(map='attic'), MapError), (Run(method='sarse'), ConfigError),
    (Run(mentor='good'), MentorError), (Run(budget=-1), MentorError),
    (Run(settings=(('speed', 1),)), ConfigError),
    (Run(settings=(('iterations', 0),)), ConfigError),
    (Run(settings=(('discount', 2.0),)), ConfigError)])
def test_an_invalid_run_is_an_error_before_it_starts(run, error):
    with pytest.raises(error):
        training_runs.validate_run(run)


def test_a_mentor_without_advice_has_no_return():
    assert training_runs.mentor_return(Run('bar_grid')) is None
    assert training_runs.mentor_return(Run('bar_grid', mentor='optimal')) == pytest.approx(
        training_runs.reference_returns_of(Run('bar_grid')).optimal_return)
