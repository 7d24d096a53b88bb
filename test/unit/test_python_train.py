# SPDX-License-Identifier: Apache-2.0
"""`comply_ros.train`: the result, the same bits as the command, and a cheap import."""

import inspect
import json
import os
from pathlib import Path
import subprocess
import sys

from bar_grid_training import use_plain_kernels
from matplotlib.figure import Figure
import numpy as np
import pytest
from tiny_tables import machine

import comply_ros
from comply_ros.experiments import train
from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.learning_result import LearningError
from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.storage.training_spec import spec_training
from comply_ros.terminal.training_options import check_options, training_parser

SMALL = {'mentor': 'noisy:0.2', 'iterations': 3, 'episodes': 4}


@pytest.fixture(scope='module')
def result():
    """Return the result of a short training."""
    return comply_ros.train('bar_grid', seed=5, **SMALL)


def test_importing_the_package_loads_nothing_else():
    code = ('import sys; before = set(sys.modules); import comply_ros;'
            'print(sorted({"numpy", "numba", "rclpy", "matplotlib", "yaml", "rich"} '
            '& set(sys.modules)), sorted(name for name in sys.modules if "comply" in name));'
            'assert comply_ros.train and "numpy" in sys.modules')
    done = subprocess.run([sys.executable, '-c', code], check=True, capture_output=True, text=True)
    assert done.stdout == "[] ['comply_ros']\n"


def test_the_package_names_what_it_has_and_nothing_else():
    assert {'train', 'TrainingResult', '__version__'} <= set(dir(comply_ros))
    with pytest.raises(AttributeError, match="module 'comply_ros' has no attribute 'trian'"):
        comply_ros.trian  # noqa: B018


def test_a_result_has_what_was_learned(result):
    states = 121
    assert (result.returns.shape, result.q.shape) == ((3,), (states, 4))
    assert (result.policy.shape, result.confidence.shape) == ((states,), (states,))
    assert set(result.policy.tolist()) <= {-1, 0, 1, 2, 3}
    assert ((0.0 <= result.confidence) & (result.confidence <= 1.0)).all()
    assert result.regret == pytest.approx(
        sum(result.reference.optimal_return - result.returns[1:]))  # the first only measures
    assert result.policy_return == result.reference.return_of(result.policy)
    assert result.digest == result.learned.state.digest()


def test_a_result_says_what_it_is_of(result):
    assert repr(result) == (
        '<TrainingResult of beta_implicit in bar_grid, mentor noisy:0.2, seed 5: 3 iterations, '
        f'the last with a mean return of {result.returns[-1]:.2f}>')


def test_a_saved_result_is_what_the_command_writes(result, tmp_path):
    argv = ('--map', 'bar_grid', '--seed', '5', '--mentor', 'noisy:0.2', '--iterations', '3',
            '--episodes', '4')
    assert train.main(['train', *argv, '--out', str(tmp_path / 'command')]) == 0
    assert result.save(tmp_path / 'python') == tmp_path / 'python'
    assert sorted(os.listdir(tmp_path / 'python')) == sorted(os.listdir(tmp_path / 'command'))
    summaries = [json.loads((tmp_path / name / 'summary.json').read_text())
                 for name in ('python', 'command')]
    for key in summaries[0]:
        if key not in ('wall_seconds', 'steps_per_second'):
            assert summaries[0][key] == summaries[1][key], key
    assert summaries[0]['policy_return'] == result.policy_return
    with np.load(tmp_path / 'python' / 'learning.npz') as one, \
            np.load(tmp_path / 'command' / 'learning.npz') as other:
        assert set(one) == set(other)
        for name in one:
            assert (one[name] == other[name]).all()


def test_a_result_is_plotted(result, tmp_path):
    for plot in (result.plot, result.plot_trust):
        assert type(plot(tmp_path / 'a.png')) is Figure
        assert (tmp_path / 'a.png').read_bytes()[:4] == b'\x89PNG'
        (tmp_path / 'a.png').unlink()


def test_each_iteration_is_reported_when_it_ends():
    iterations = []
    result = comply_ros.train('bar_grid', on_iteration=iterations.append, **SMALL)
    assert [each.mean_return for each in iterations] == result.returns.tolist()


def test_a_training_begins_from_a_result_or_its_file(result, tmp_path):
    result.save(tmp_path)
    one = comply_ros.train('bar_grid', initial_learning=result, **SMALL)
    other = comply_ros.train('bar_grid', initial_learning=tmp_path / 'learning.npz', **SMALL)
    assert one.digest == other.digest != comply_ros.train('bar_grid', **SMALL).digest
    assert other.summary['initial_learning'] == str(tmp_path / 'learning.npz')


def test_without_learning_the_policy_is_acted_by(result):
    acting = comply_ros.train('bar_grid', initial_learning=result, learns=False, iterations=1,
                              episodes=2000, seed=8)
    assert (acting.policy == result.policy).all()
    assert acting.returns[0] == pytest.approx(result.policy_return, abs=0.6)
    assert (acting.q == result.q).all()


def test_what_was_learned_can_be_a_mentor(result, tmp_path):
    result.save(tmp_path)
    taught = comply_ros.train('bar_grid', mentor=f'learned:{tmp_path}/learning.npz', iterations=2)
    assert (taught.advice == result.policy).all()
    assert taught.summary['mentor_return'] == result.policy_return


@pytest.mark.parametrize(('settings', 'error', 'message'), [
    ({'method': 'sarse'}, ConfigError, 'a method must be one of'),
    ({'mentor': 'learner:/robot_2'}, MentorError,
     'a mentor that follows a running learner must be a node of its own'),
    ({'speed': 1}, ConfigError, "a method has no field 'speed'"),
    ({'iterations': 0}, ConfigError, 'a training needs an end'),
    ({'initial_learning': 'nowhere.npz'}, LearningError, 'a learning file must be readable'),
])
def test_a_mistake_is_one_sentence(settings, error, message):
    with pytest.raises(error, match=message):
        comply_ros.train('bar_grid', **settings)


def test_a_learning_of_another_world_is_rejected(result):
    with pytest.raises(LearningError, match='was learned in another world'):
        comply_ros.train('free_grid', initial_learning=result)


def test_the_command_rejects_a_learning_of_another_world_in_one_line(result, tmp_path, capsys):
    result.save(tmp_path)
    capsys.readouterr()
    file, out = f'{tmp_path}/learning.npz', str(tmp_path / 'out')
    for argv in (('--from', file), ('--mentor', f'learned:{file}')):
        assert train.main(['train', '--map', 'free_grid', *argv, '--out', out]) == 2
        error = capsys.readouterr().err
        assert error.startswith('train: the learning file') and error.count('\n') == 1
        assert 'was learned in another world' in error


def test_the_defaults_are_those_of_the_command():
    here = {name: each.default for name, each in inspect.signature(comply_ros.train)
            .parameters.items() if each.default is not each.empty}
    below = {name: each.default for name, each in inspect.signature(spec_training)
             .parameters.items()}
    command = vars(training_parser('train', '').parse_args([]))
    assert len(command) > 10
    for name in ('map', 'method', 'mentor', 'profile', 'seed', 'mentor_seed', 'budget', 'advising',
                 'initial_learning'):
        assert here[name] == below['map_name' if name == 'map' else name] == command[name], name


def test_the_package_is_typed():
    assert (Path(comply_ros.__file__).parent / 'py.typed').exists()


@pytest.fixture(scope='module')
def of_machine():
    """Return the result of a short training in a world that is a table."""
    with pytest.MonkeyPatch.context() as patch:
        use_plain_kernels(patch)
        return comply_ros.train(machine(), 'explicit', 'noisy:0.2', iterations=3, episodes=4)


def test_a_table_is_a_world_to_train_in(of_machine, tmp_path):
    assert of_machine.world.table == machine()
    assert (of_machine.q.shape, of_machine.policy.shape) == ((3, 3), (3,))
    assert of_machine.training.map_name == f'table {machine().sha256[:8]}'
    assert of_machine.reference.optimal_return == pytest.approx(4.0)
    folder = of_machine.save(tmp_path / 'out')
    assert {each.name for each in folder.iterdir()} == {
        'summary.json', 'learning.npz', 'learning_curve.png', 'confidence.png', 'trust_map.png',
        'mentor.txt'}
    assert (folder / 'mentor.txt').read_text().split()[::2] == ['0', '1']
    assert json.loads((folder / 'summary.json').read_text())['digest'] == of_machine.digest


def test_what_was_learned_in_a_table_is_a_mentor_and_a_start(of_machine, monkeypatch, tmp_path):
    use_plain_kernels(monkeypatch)
    folder = of_machine.save(tmp_path)
    mentor = comply_ros.train(machine(), mentor=f'learned:{folder / "learning.npz"}', **{
        'iterations': 1, 'episodes': 2})
    assert mentor.advice.tolist() == of_machine.policy.tolist()
    again = comply_ros.train(machine(), 'explicit', f'file:{folder / "mentor.txt"}',
                             initial_learning=of_machine, iterations=1, learns=False)
    assert again.policy.tolist() == of_machine.policy.tolist()
    with pytest.raises(LearningError, match='was learned in another world'):
        comply_ros.train(machine(limit=51), initial_learning=of_machine)


def test_a_command_trains_in_a_map_that_is_a_table(monkeypatch, tmp_path, capsys):
    use_plain_kernels(monkeypatch)
    monkeypatch.setattr('comply_ros.storage.training_spec.read_world', lambda *_: machine())
    parser = training_parser('train', 'x')
    parser.add_argument('--seeds', default=1)
    options = check_options(parser.parse_args(
        ['--map', 'machine', '--method', 'explicit', '--mentor', 'noisy:0.2', '--iterations', '3',
         '--episodes', '4', '--out', str(tmp_path)]))
    assert train.run(options) == 0
    assert 'trust_map.png' in capsys.readouterr().out
    assert (tmp_path / 'trust_map.png').stat().st_size > 1000
