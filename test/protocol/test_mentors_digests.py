# SPDX-License-Identifier: Apache-2.0
"""Several mentors: the same bits compiled, plain, and by messages in any order, with kills."""

from dataclasses import replace
import os
import random

from bar_grid_training import own_code, use_plain_kernels
from mentors_network import MentorsNetwork, MortalLearnerNetwork
import numpy as np
import pytest

from comply_ros.experiments.stepped_training import SteppedTraining
from comply_ros.learner.presets import METHODS
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.mentor.mentor_policies import noisy_policy
from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.messages import Progress
from comply_ros.protocol.world_moves import ModelMoves
from comply_ros.storage import checkpoint_store
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

BAR, SEED, ITERATIONS = read_map('bar_grid', 'published'), 4, 3


def policies_by_name():
    """Return (policy, budget) of three mentors, of which one has no advice in many states."""
    world = World(BAR)
    sparse = optimal_policy(world)
    sparse[::3] = -1
    return {'anna': (noisy_policy(world, 0.3, random_streams(8)[0]), 0), 'bob': (sparse, 25),
            'carl': (noisy_policy(world, 0.9, random_streams(9)[0]), 0)}


POLICIES = policies_by_name()


def mentors(world):
    """Return the `AdviceBudget` of each mentor, as new."""
    return {name: AdviceBudget(world, *each) for name, each in POLICIES.items()}


def trained(config):
    """Return a training with the three mentors, and the results of its iterations."""
    learning = Training(World(BAR), mentors(World(BAR)), config, SEED)
    return learning, [learning.iterate() for _ in range(config.iterations)]


def settings(name, episodes=2):
    """Return the settings of a short training of a method."""
    return replace(METHODS['published'][name], episodes=episodes, iterations=ITERATIONS)


def assert_reports(reports, results):
    """Fail unless reports are those of results: one for all mentors, then one for each."""
    expected = [(result.number, result.mean_return, confidence, name) for result in results
                for name, confidence in zip(('', *POLICIES),
                                            (result.confidence, *result.confidences))]
    found = [(msg.iteration, msg.mean_return, msg.confidence, msg.mentor) for msg in reports
             if isinstance(msg, Progress)]
    assert repr(found) == repr(expected)  # repr, because nan is not equal to itself


def stepped(config):
    """Return the same, step by step."""
    world = World(BAR)
    learning = SteppedTraining(world, ModelMoves(world, SEED), mentors(world), config, SEED)
    return learning, [learning.iterate() for _ in range(config.iterations)]


# test_stepped_training.py has this for two methods in the usual run.
@pytest.mark.long
@pytest.mark.parametrize('name', METHODS['published'])
def test_several_mentors_give_the_same_bits_compiled_and_plain(monkeypatch, name):
    compiled, results = trained(settings(name))
    use_plain_kernels(monkeypatch)
    plain, plain_results = trained(settings(name))
    assert plain.state.digest() == compiled.state.digest()
    assert plain.advice.tolist() == compiled.advice.tolist()
    assert repr(plain_results) == repr(results)


@pytest.mark.parametrize('name', [
    pytest.param(name, marks=pytest.mark.long) if own_code(METHODS['published'][name]) & {
        'has_model', 'has_planner'} else name for name in METHODS['published']])
def test_several_mentors_give_the_same_bits_in_any_order(monkeypatch, name):
    use_plain_kernels(monkeypatch)
    config = settings(name)
    training, results = trained(config)
    digest, advice = training.state.digest(), training.advice.tolist()
    for shuffle, remembers_advice in ((1, True), (2, False)):
        network = MentorsNetwork(config, BAR, POLICIES, SEED, random.Random(shuffle),
                                 remembers_advice).run()
        assert network.learner.state.digest() == digest
        assert_reports(network.reports, results)
    if config.needs_mentor():
        assert network.learner.advice().tolist() == advice
    other, other_results = stepped(config)
    assert other.state.digest() == digest and other.advice.tolist() == advice
    assert repr(other_results) == repr(results)


def test_each_mentor_has_a_budget_of_its_own(monkeypatch):
    use_plain_kernels(monkeypatch)
    world = World(BAR)
    found = mentors(world)
    learning = Training(world, found, settings('explicit'), SEED)
    learning.iterate()
    assert [each.remaining[0] for each in found.values()] == [0, found['bob'].remaining[0], 0]
    assert found['bob'].remaining[0] < 25
    rows = learning.advice.reshape(3, -1)
    assert np.count_nonzero(rows[0] >= 0) > np.count_nonzero(rows[1] >= 0) > 0


@pytest.mark.parametrize('name, rate', [
    ('vanishing', 0.2), ('beta_implicit', 0.1), ('explicit_lambda', 0.3), ('head_start', 0.1),
    ('model_based', 0.1), ('policy_shaping', 0.1)])
@pytest.mark.parametrize('remembers_advice', [True, False])
def test_a_learner_with_three_mentors_that_is_killed_at_any_time_learns_the_same(
        tmp_path, monkeypatch, name, rate, remembers_advice):
    monkeypatch.setattr(checkpoint_store, 'RECORDS_PER_CHECKPOINT', 60)
    for call in ('fsync', 'fdatasync'):  # a kill takes nothing that was written
        monkeypatch.setattr(os, call, lambda file: None)
    use_plain_kernels(monkeypatch)
    config = settings(name, episodes=1)
    expected, results = stepped(config)
    network = MortalLearnerNetwork(tmp_path, min(rate, 8 / sum(each.steps for each in results)),
                                   config, BAR, POLICIES, SEED, random.Random(name),
                                   remembers_advice)
    network.run()
    network.kill()  # what it has finished with is on disk
    network.store.close()
    assert network.kills > 5 and network.learner.finished
    assert network.learner.state.digest() == expected.state.digest()
    assert list(network.learner.mentors) == list(POLICIES)
    assert_reports(network.learner.reports, results)
