# SPDX-License-Identifier: Apache-2.0
"""The options of a training, everything that can be wrong with them, and its results."""

from concurrent.futures import Future
from contextlib import contextmanager
import json
import os

from bar_grid_training import use_shared_code
import numpy as np
import pytest

from comply_ros.experiments import train
from comply_ros.learner.learner_state import LearnerState
from comply_ros.learner.presets import METHODS
from comply_ros.mentor.policy_text import parse_policy
from comply_ros.storage.map_files import read_map
from comply_ros.terminal.training_options import check_options, training_parser
from comply_ros.world.mdp import World

SHORT = ('--map', 'bar_grid', '--mentor', 'noisy:0.2', '--iterations', '3', '--episodes', '4')


def checked(*argv):
    """Return the `TrainingOptions` of a command line."""
    return check_options(training_parser('train', '').parse_args(argv))


def run(folder, *argv):
    """Train, and return the exit code and the summary."""
    code = train.main(['train', *SHORT, '--out', str(folder), *argv])
    path = folder / 'summary.json'
    return code, json.loads(path.read_text()) if path.exists() else None


@pytest.fixture(scope='module')
def trained(tmp_path_factory):
    """Return the folder and the summary of a training."""
    folder = tmp_path_factory.mktemp('trained')
    code, summary = run(folder)
    assert code == 0
    return folder, summary


@pytest.fixture
def asked_plots(monkeypatch):
    """Return the list of the plots that trainings ask for; none is drawn."""
    asked = []

    def plot(name, *arguments):
        done = Future()
        done.set_result(asked.append(name))
        return done

    @contextmanager
    def plot_process():
        yield plot
    monkeypatch.setattr(train, 'plot_process', plot_process)
    return asked


def test_options_are_checked_and_resolved(tmp_path):
    options = checked('--method', 'explicit', '--profile', 'report', '--set', 'trust_rate=0.2',
                      '--iterations', '7', '--out', str(tmp_path), '--seed', '5')
    config = options.config
    assert (config.trust_rate, config.iterations, config.episodes) == (0.2, 7, 15)
    assert options.settings == {'trust_rate': 0.2, 'iterations': 7}
    assert options.source == read_map('maze', 'report')
    assert (options.seed, options.out, options.spec.kind) == (5, tmp_path, 'snapshot')


def test_the_folder_is_named_after_the_training(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert str(checked('--seed', '4').out) == 'runs/maze-beta_implicit-snapshot_0.75-4'


@pytest.mark.parametrize('argv, message', [
    (('--map', 'nowhere'), "map 'nowhere': a map must be one of"),
    (('--method', 'sarse'), "did you mean 'sarsa'? a method must be one of sarsa, "),
    (('--set', 'confidenc=3'), "did you mean 'confidence'? a method has no field 'confidenc'; "),
    (('--profile', 'x'), 'a profile must be one of report, published'),
    (('--mentor', 'good'), 'a mentor must be one of optimal, '),
    (('--mentor', 'file:/nowhere'), 'a policy file must be readable'),
    (('--set', 'speed=1'), "a method has no field 'speed'"),
    (('--set', 'discount'), "--set takes FIELD=VALUE, got 'discount'"),
    (('--set', 'discount=2'), 'discount must lie in [0, 1], got 2.0'),
    (('--iterations', '0'), 'a training needs an end: iterations must be at least 1, got 0'),
    (('--iterations', 'many'), "iterations must be a whole number, got 'many'"),
    (('--episodes', '0'), 'episodes must lie in [1, 1000000], got 0'),
    (('--seed', '-1'), 'seed must lie in [0, 9007199254740992], got -1'),
    (('--seeds', '0'), 'seeds must be at least 1, got 0'),
])
def test_a_mistake_is_one_line_and_exit_code_2(tmp_path, capsys, argv, message):
    code, summary = run(tmp_path / 'out', *argv)
    error = capsys.readouterr().err
    assert (code, summary) == (2, None)
    assert error.startswith(f'train: {message}')
    assert error.count('\n') == 1


def test_a_policy_of_another_shape_is_rejected_before_the_training(tmp_path, capsys):
    (tmp_path / 'policy.txt').write_text('>>G\n')
    code, _ = run(tmp_path / 'out', '--mentor', f'file:{tmp_path / "policy.txt"}')
    assert code == 2
    assert capsys.readouterr().err == (
        'train: a policy must have a row for each of the 11 rows of the map, got 1\n')


def test_a_folder_that_cannot_be_written_is_reported_before_the_training(
        tmp_path, capsys, monkeypatch):
    (tmp_path / 'taken').write_text('a file where a folder should be')
    monkeypatch.setattr('comply_ros.experiments.stepped_training.Training', None)
    assert run(tmp_path / 'taken' / 'out')[0] == 2
    assert "an output folder must be writable, got '" in capsys.readouterr().err
    assert (tmp_path / 'taken').read_text() == 'a file where a folder should be'


def test_a_folder_with_the_name_of_a_result_is_reported_before_the_training(tmp_path, capsys):
    (tmp_path / 'summary.json').mkdir()
    assert run_code(tmp_path) == 2
    assert 'a result must not have the name of a folder' in capsys.readouterr().err


def run_code(folder):
    """Return the exit code of a short training."""
    return train.main(['train', *SHORT, '--out', str(folder)])


def test_planning_that_does_not_settle_is_reported_before_the_training(
        tmp_path, capsys, monkeypatch):
    monkeypatch.setattr('comply_ros.world.planning.MOST_SWEEPS', 3)
    monkeypatch.setattr('comply_ros.experiments.stepped_training.Training', None)
    assert run_code(tmp_path) == 2
    assert 'train: value iteration must settle within 3 sweeps' in capsys.readouterr().err


def test_a_summary_has_its_documented_fields(trained):
    _, summary = trained
    assert set('map profile method mentor mentor_return mentor_optimality optimal_return '
               'random_return seed iterations episodes steps wall_seconds steps_per_second '
               'return_per_iteration confidence_per_iteration time_to_convergence reward_ratio '
               'regret final_return policy_return initial_learning digest'.split()) <= set(summary)
    assert (summary['iterations'], summary['episodes']) == (3, 4)
    assert len(summary['return_per_iteration']) == 3
    confidences, = summary['confidence_per_iteration'].values()
    assert len(confidences) == 3 and all(0.0 < each < 1.0 for each in confidences)
    assert summary['final_return'] == summary['return_per_iteration'][-1]
    assert summary['regret'] == pytest.approx(
        sum(summary['optimal_return'] - value for value in summary['return_per_iteration'][1:]))
    assert summary['measuring_iterations'] == 1  # of the published runs, and not counted
    assert len(summary['digest']) == 64
    assert summary['random_return'] < summary['mentor_return'] < summary['optimal_return']


def test_learning_npz_has_the_arrays_of_the_learner(trained):
    folder, _ = trained
    with np.load(folder / 'learning.npz') as learned:
        assert learned['q'].shape == (121, 4)
        assert set(learned) == {*LearnerState._fields, 'advice', 'policy', 'confidence', 'world',
                                'settings', 'format', 'mentors'}
        assert ((0 <= learned['confidence']) & (learned['confidence'] <= 1)).all()
    world = World(read_map('bar_grid', 'published'))
    assert parse_policy((folder / 'mentor.txt').read_text(), world).shape == (121,)


def test_pictures_are_drawn(trained):
    folder, _ = trained
    for name in ('learning_curve.png', 'confidence.png', 'trust_map.png'):
        assert (folder / name).read_bytes()[:8] == b'\x89PNG\r\n\x1a\n'
        assert (folder / name).stat().st_size > 10_000


def test_the_summary_of_many_seeds_lists_those_of_single_seeds(tmp_path, asked_plots):
    _, many = run(tmp_path / 'many', '--seeds', '3', '--seed', '5')
    singles = [run(tmp_path / str(k), '--seed', str(k))[1] for k in (5, 6, 7)]
    for key in ('seed', 'steps', 'return_per_iteration', 'confidence_per_iteration', 'regret',
                'digest', 'final_return', 'time_to_convergence', 'reward_ratio'):
        assert many[key] == [single[key] for single in singles], key
    assert many['optimal_return'] == singles[0]['optimal_return']


def test_the_summary_of_a_training_without_a_mentor_names_none(tmp_path):
    _, summary = run(tmp_path, '--mentor', 'none', '--method', 'sarsa')
    assert summary['mentor_return'] is summary['mentor_optimality'] is None
    assert summary['confidence_per_iteration'] == {}
    assert not (tmp_path / 'trust_map.png').exists()
    assert not (tmp_path / 'confidence.png').exists()


@pytest.mark.parametrize('name', METHODS['published'])
def test_every_method_trains_from_the_command_line(tmp_path, monkeypatch, name, asked_plots):
    use_shared_code(monkeypatch, METHODS['published'][name])
    assert run(tmp_path, '--method', name)[1]['method'] == name
    assert asked_plots == ['draw_learning_curve', 'draw_confidence_curves', 'draw_trust_map'][
        :3 if METHODS['published'][name].needs_mentor() else 1]


def test_only_results_are_left_in_the_folder(trained):
    folder, _ = trained
    assert sorted(os.listdir(folder)) == [
        'confidence.png', 'learning.npz', 'learning_curve.png', 'mentor.txt', 'summary.json',
        'trust_map.png']
