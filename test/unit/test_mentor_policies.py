# SPDX-License-Identifier: Apache-2.0
"""Mentors of every quality."""

from functools import cache
import os

import numpy as np
import pytest
from tiny_tables import frozen_lake, machine
from tiny_worlds import corridor

from comply_ros.learner.mentor_factory import make_policy
from comply_ros.mentor.mentor_spec import MentorError, MentorSpec, parse_mentor_spec
from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import (
    is_slow,
    mentor_policy,
    read_mentor_spec,
    validate_files,
)
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy, ReferenceReturns
from comply_ros.world.state_action_spaces import Spaces

FREE_GRID = World(read_map('free_grid', 'report'))


@cache
def made(text):
    """Return the policy of a mentor on `free_grid`; a snapshot is made by a whole training."""
    return make_policy(parse_mentor_spec(text), FREE_GRID, 0)


def optimality(text):
    """Return the optimality level of a mentor on `free_grid`."""
    reference = ReferenceReturns(FREE_GRID)
    return reference.optimality(reference.return_of(made(text)))


def test_an_adversarial_mentor_advises_the_worst_action():  # in `..G`: left, away from the goal
    assert make_policy(MentorSpec('adversarial'), corridor(), 0).tolist() == [1, 0, -1]


def test_a_sparse_mentor_has_advice_in_a_share_of_the_states_by_seed():
    best = optimal_policy(FREE_GRID)
    one, same, other = (mentor_policy(read_mentor_spec('optimal@0.25'), FREE_GRID, seed)
                        for seed in (0, 0, 1))
    assert (one != -1).sum() == (other != -1).sum() == 30  # of 120 free cells
    assert (one == same).all() and (one != other).any()
    assert (one[one != -1] == best[one != -1]).all()
    assert (mentor_policy(read_mentor_spec('optimal@0'), FREE_GRID, 0) == -1).all()


def test_noise_spoils_a_share_of_the_states():
    best = optimal_policy(FREE_GRID)
    spoiled = make_policy(MentorSpec('noisy', 0.5), FREE_GRID, 0)
    assert 0.2 < np.mean(spoiled[FREE_GRID.free] != best[FREE_GRID.free]) < 0.5
    assert (make_policy(MentorSpec('noisy', 0.0), FREE_GRID, 0) == best).all()
    assert (make_policy(MentorSpec('noisy', 1.0), FREE_GRID, 5)
            == make_policy(MentorSpec('random'), FREE_GRID, 5)).all()


@pytest.mark.parametrize('text', ['random', 'noisy:1.0', 'noisy:1'])
def test_where_every_state_is_spoiled_no_policy_is_planned(monkeypatch, text):
    generator = np.random.Generator(np.random.PCG64(7))
    generator.random(121)
    priorities = np.where(FREE_GRID.available, generator.random((121, 4)), -np.inf)
    monkeypatch.setattr('comply_ros.mentor.mentor_policies.optimal_policy', None)
    policy = make_policy(parse_mentor_spec(text), FREE_GRID, 7)
    assert policy.dtype == np.int8
    assert policy.tolist() == np.where(FREE_GRID.free, priorities.argmax(axis=1), -1).tolist()
    with pytest.raises(TypeError):  # here one has to be
        make_policy(parse_mentor_spec('noisy:0.5'), FREE_GRID, 7)


def test_mentors_are_ordered_by_their_quality():
    assert optimality('optimal') == 1.0
    assert optimality('none') == 0.0
    assert optimality('adversarial') < optimality('snapshot:0.75') < 1.0
    assert optimality('noisy:0.02') > optimality('noisy:0.3')


def test_a_snapshot_is_near_to_the_wanted_level():
    assert optimality('snapshot:0.75') == pytest.approx(0.75, abs=0.05)


def test_all_advice_is_available():
    for text in ('optimal', 'random', 'adversarial', 'noisy:0.4', 'snapshot:0.75'):
        policy = made(text)
        states = np.flatnonzero(FREE_GRID.free)
        assert FREE_GRID.available[states, policy[states]].all()
        assert (policy[~FREE_GRID.free] == -1).all()


def test_the_seed_decides_which_mentor_it_is():
    first, same, other = (make_policy(MentorSpec('random'), FREE_GRID, k) for k in (1, 1, 2))
    assert (first == same).all() and (first != other).any()


def test_a_generated_mentor_is_cached(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    spec, world = parse_mentor_spec('snapshot:0.6'), FREE_GRID
    assert is_slow(spec, world, 0)
    made = mentor_policy(spec, world, 0)
    assert not is_slow(spec, world, 0)
    cached, = (tmp_path / 'comply_ros' / 'mentors').iterdir()
    monkeypatch.setattr('comply_ros.storage.mentor_cache.make_policy', None)
    assert (mentor_policy(spec, world, 0) == made).all()
    assert is_slow(parse_mentor_spec('snapshot:0.61'), world, 0)
    monkeypatch.undo()
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    cached.write_text('spoiled')
    assert (mentor_policy(spec, world, 0) == made).all()


def test_a_cache_that_cannot_be_written_is_no_reason_to_stop(tmp_path, monkeypatch):
    (tmp_path / 'comply_ros').write_text('a file where a folder should be')
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    assert mentor_policy(parse_mentor_spec('snapshot:0.6'), FREE_GRID, 0).shape == (121,)


def test_a_policy_file_is_a_mentor(tmp_path):
    path = tmp_path / 'mine.txt'
    path.write_text('>>G\n')
    assert mentor_policy(read_mentor_spec(f'file:{path}'), corridor(), 0).tolist() == [1, 1, -1]
    with pytest.raises(PolicyError, match='^a policy must have a row for each of the 11 rows '):
        mentor_policy(read_mentor_spec(f'file:{path}'), FREE_GRID, 0)
    several = read_mentor_spec(f'optimal + mine=file:{path}')
    with pytest.raises(PolicyError, match='^mentor mine: a policy must have a row for each of '):
        mentor_policy(several, FREE_GRID, 0)
    with pytest.raises(PolicyError, match='^mentor mine: a policy must have a row for each of '):
        validate_files(several, FREE_GRID)


def test_a_policy_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(MentorError) as error:
        read_mentor_spec('file:/nowhere/mine.txt')
    assert str(error.value) == ("a policy file must be readable, got '/nowhere/mine.txt' "
                                '(no such file or directory)')
    (tmp_path / 'bytes').write_bytes(bytes(range(256)))
    with pytest.raises(MentorError, match='it is not text'):
        read_mentor_spec(f'file:{tmp_path / "bytes"}')
    assert os.path.exists(tmp_path / 'bytes')


@pytest.mark.parametrize('text, actions', [
    ('optimal', [0, 1, -1]), ('adversarial', [1, 2, -1]), ('none', [-1, -1, -1]),
    ('noisy:0', [0, 1, -1])])
def test_mentors_of_a_world_without_a_grid(text, actions):  # q: (4, 0, none), (-0.25, 0, -1)
    policy = mentor_policy(read_mentor_spec(text), World(machine()), 0)
    assert (policy.tolist(), policy.dtype) == (actions, np.int8)


def test_a_random_mentor_gives_every_action_of_a_state():
    world = World(machine())
    policies = {tuple(mentor_policy(read_mentor_spec('random'), world, seed).tolist())
                for seed in range(60)}
    assert policies == {(a, b, -1) for a in (0, 1) for b in (0, 1, 2)}


def test_a_sparse_mentor_has_advice_in_a_share_of_the_states_where_an_episode_can_go_on():
    world = World(frozen_lake())
    policy = mentor_policy(read_mentor_spec('optimal@0.5'), world, 0)
    assert (policy >= 0).sum() == round(0.5 * world.free.sum())
    assert not (policy[~world.free] >= 0).any()


@pytest.mark.parametrize('text', ['optimal', 'adversarial', 'noisy:0.5', 'snapshot:0.5'])
def test_a_mentor_that_must_plan_needs_a_model(text):
    with pytest.raises(MentorError) as error:
        make_policy(parse_mentor_spec(text), World(Spaces(3, ('go', 'wait'), 10)), 0)
    kind = text.partition(':')[0]
    assert str(error.value) == (
        f'a mentor of the kind {kind!r} must plan, and nobody knows what an action leads to in a '
        'world without a model: use one from a file (file:PATH), from a training '
        '(learned:FILE.npz), random, none, a person, or a node of your own')


def test_without_a_model_a_mentor_can_be_random_or_from_a_file(tmp_path):
    world, file = World(Spaces(3, ('go', 'wait'), 10)), tmp_path / 'policy.txt'
    file.write_text('1 wait')
    assert mentor_policy(read_mentor_spec(f'file:{file}'), world, 0).tolist() == [-1, 1, -1]
    assert set(make_policy(parse_mentor_spec('random'), world, 0).tolist()) <= {0, 1}
