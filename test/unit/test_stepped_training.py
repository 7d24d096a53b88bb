# SPDX-License-Identifier: Apache-2.0
"""Training step by step: the bits of the compiled loop, and environments without a table."""

from dataclasses import replace
import json

from bar_grid_training import own_code, PRESETS
import numpy as np
from own_environments import write_environments
import pytest

import comply_ros
from comply_ros.experiments import train
from comply_ros.experiments.stepped_training import SteppedTraining, training_in
from comply_ros.learner.learner_state import FIRST_RECORD, SCALE
from comply_ros.learner.mentor_factory import make_policy
from comply_ros.learner.presets import find_method, METHODS
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.mentor.mentor_spec import MentorError, parse_mentor_spec
from comply_ros.protocol.world_moves import ModelMoves
from comply_ros.storage.gymnasium_moves import EnvironmentFault
from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import MapError
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy
from comply_ros.world.state_action_spaces import Spaces

CAR = 'gym:MountainCar-v0?bins=8'
SMALL = ('--map', CAR, '--mentor', 'random', '--iterations', '2', '--episodes', '2')


def both(name, profile, budget=0, when='early', seed=3):
    """Return what two iterations in `bar_grid` result in: compiled, and step by step."""
    world = World(read_map('bar_grid', profile))
    advice = optimal_policy(world)
    advice[::3] = -1
    config = replace(find_method(name, profile), episodes=4)
    trainings = (
        Training(world, AdviceBudget(world, advice, budget, when), config, seed),
        SteppedTraining(world, ModelMoves(world, seed), AdviceBudget(world, advice, budget, when),
                        config, seed))
    return [([repr(each.iterate()) for _ in range(2)], each.state.digest(), each.advice.tolist())
            for each in trainings]


@pytest.mark.parametrize('profile, name', [
    pytest.param(profile, name, marks=pytest.mark.long) if own_code(METHODS[profile][name])
    else (profile, name) for profile, name in PRESETS])
def test_a_plain_loop_gives_the_bits_of_the_compiled_one(profile, name):
    compiled, stepped = both(name, profile)
    assert stepped == compiled


@pytest.mark.parametrize('name', [
    'policy_shaping_estimated',
    *(pytest.param(name, marks=pytest.mark.long) for name in ('majority_vote', 'rlpa'))])
def test_a_plain_loop_with_several_mentors_gives_the_bits_of_the_compiled_one(name):
    world = World(read_map('bar_grid', 'published'))
    config = replace(find_method(name, 'published'), episodes=4)
    mentors = {text: AdviceBudget(world, make_policy(parse_mentor_spec(text), world, 1))
               for text in ('noisy:0.3', 'random', 'noisy:0.6')}
    trainings = (Training(world, mentors, config, 3),
                 SteppedTraining(world, ModelMoves(world, 3), mentors, config, 3))
    compiled, stepped = ([repr(each.iterate()) for _ in range(5)] for each in trainings)
    assert stepped == compiled
    assert trainings[1].state.digest() == trainings[0].state.digest()


@pytest.mark.long
def test_episodes_without_a_reward_count_alike_in_both():
    world = World(read_map('frozen_lake', 'published'))
    config = replace(find_method('model_based', 'published'), episodes=4)
    advice = make_policy(parse_mentor_spec('adversarial'), world, 0)
    mentor, other = (AdviceBudget(world, advice) for _ in range(2))
    trainings = (Training(world, mentor, config, 3),
                 SteppedTraining(world, ModelMoves(world, 3), other, config, 3))
    for each in trainings:
        each.iterate()
    compiled, stepped = (each.state for each in trainings)
    assert stepped.digest() == compiled.digest()
    assert compiled.advice_seen[0] >= FIRST_RECORD + 4.0 and compiled.pooled[SCALE] == 0.0


@pytest.mark.parametrize('when', ['early', 'important', 'mistakes'])
def test_a_mentor_with_a_budget_spends_it_in_the_same_states(when):
    compiled, stepped = both('beta_implicit', 'report', 20, when)
    assert stepped == compiled


def test_without_a_model_a_world_must_be_an_environment():
    world = World(Spaces(3, ('go', 'wait'), 10))
    nobody = AdviceBudget(world, np.full(3, -1))
    with pytest.raises(MapError, match="or a map gym:NAME, got 'spaces'"), training_in(
            world, 'spaces', nobody, find_method('sarsa', 'report'), 0):
        pass


@pytest.fixture(scope='module')
def result():
    """Return the result of a short training in an environment without a table."""
    pytest.importorskip('gymnasium')
    return comply_ros.train(CAR, 'beta_implicit', 'random', iterations=2, episodes=2, seed=4)


def test_an_environment_without_a_table_is_trained_in(result):
    assert result.q.shape == (64, 3)
    assert result.returns.tolist() == [-200.0, -200.0]
    assert result.steps == 800
    again = comply_ros.train(CAR, 'beta_implicit', 'random', iterations=2, episodes=2, seed=4)
    other = comply_ros.train(CAR, 'beta_implicit', 'random', iterations=2, episodes=2, seed=5)
    assert again.digest == result.digest != other.digest


def test_figures_that_need_the_optimum_are_named_as_unknown(result):
    summary = result.summary
    assert summary['unknown'] == [
        'mentor_return', 'mentor_optimality', 'optimal_return', 'random_return',
        'convergence_threshold', 'time_to_convergence', 'reward_ratio', 'regret', 'policy_return']
    assert {summary[name] for name in summary['unknown']} == {None}
    assert result.regret is None and result.policy_return is None
    assert comply_ros.train('bar_grid', mentor='none', iterations=1).summary['unknown'] == []


def test_a_command_writes_its_results_and_says_what_is_not_known(tmp_path, capsys):
    pytest.importorskip('gymnasium')
    assert train.main(['train', *SMALL, '--seeds', '2', '--out', str(tmp_path)]) == 0
    output = ' '.join(capsys.readouterr().out.split())
    assert 'time to convergence: the world has no model' in output
    assert 'optimal policy' not in output
    summary = json.loads((tmp_path / 'summary.json').read_text())
    assert (summary['map'], summary['regret']) == (CAR, [None, None])
    assert {each.name for each in tmp_path.iterdir()} == {
        'summary.json', 'learning.npz', 'learning_curve.png', 'confidence.png', 'trust_map.png',
        'mentor.txt'}


def test_what_was_learned_is_a_mentor_and_a_start(result, tmp_path):
    file = result.save(tmp_path) / 'learning.npz'
    taught = comply_ros.train(CAR, mentor=f'learned:{file}', initial_learning=file,
                              iterations=1, episodes=1)
    assert (taught.advice == result.policy).all()


@pytest.mark.parametrize('argv, message', [
    (('--mentor', 'optimal'), "train: a mentor of the kind 'optimal' must plan, and nobody knows "
     'what an action leads to in a world without a model: use one from a file'),
    (('--budget', '5', '--advising', 'important'), "train: advising 'important' must know what an "
     'action leads to, and the world has no model: use early or mistakes'),
    (('--map', 'gym:CartPole-v1'), "train: map 'gym:CartPole-v1': environment 'CartPole-v1': the "
     'observation space needs finite limits')])
def test_what_needs_a_model_is_rejected_before_the_training(argv, message, tmp_path, capsys):
    pytest.importorskip('gymnasium')
    assert train.main(['train', *SMALL, *argv, '--out', str(tmp_path / 'out')]) == 2
    error = capsys.readouterr().err
    assert error.startswith(message) and error.count('\n') == 1


def test_such_a_mentor_is_a_value_error_in_python():
    pytest.importorskip('gymnasium')
    with pytest.raises(MentorError, match='must plan'):
        comply_ros.train(CAR)


def test_an_environment_that_raises_ends_the_command_with_what_it_said(
        tmp_path, monkeypatch, capsys):
    pytest.importorskip('gymnasium')
    write_environments(tmp_path, monkeypatch)
    monkeypatch.syspath_prepend(tmp_path)
    name = 'gym:own_envs:Broken-v0'
    sentence = ("environment 'own_envs:Broken-v0' raised RuntimeError in episode 1, step 3: the "
                'motor is off')
    assert train.main(['train', *SMALL, '--map', name, '--out', str(tmp_path / 'out')]) == 1
    printed = capsys.readouterr()
    assert printed.err.endswith(f'train: {sentence}\n')
    assert printed.out.count('closes') == 2  # that which was looked at, and that which was stepped
    with pytest.raises(EnvironmentFault, match=sentence):
        comply_ros.train(name, mentor='none')
