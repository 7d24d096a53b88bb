# SPDX-License-Identifier: Apache-2.0
"""Digests of what every learner and mentor computes: they guard ALGORITHM_VERSION."""

import hashlib

from bar_grid_training import use_plain_kernels, use_shared_code
from golden_digests import CHANGED, golden_digests
import pytest
from tiny_tables import machine

from comply_ros.learner.mentor_factory import make_policy
from comply_ros.learner.presets import METHODS
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget, ADVISING_MODES
from comply_ros.mentor.mentor_policies import sparse_policy
from comply_ros.mentor.mentor_spec import parse_mentor_spec
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World

GOLDEN = {part: golden_digests(part) for part in ('trainings', 'budgets', 'mentors', 'tables')}
ROWS = [(profile, method) for profile in METHODS for method in METHODS[profile]]
MAP, MENTOR, SEED, ITERATIONS = 'bar_grid', 'noisy:0.3', 3, 6
BUDGET = 20


def training_digest(profile, method, budget=0, advising='early', source=None):
    """Return the digest of a short training of one preset in one profile, or in another world."""
    world = World(source or read_map(MAP, profile))
    advice = make_policy(parse_mentor_spec(MENTOR), world, SEED)
    mentor = AdviceBudget(world, advice, budget, advising)
    training = Training(world, mentor, METHODS[profile][method], SEED)
    for _ in range(ITERATIONS):
        training.iterate()
    return training.state.digest()


@pytest.mark.parametrize(('profile', 'method'), ROWS)
def test_a_short_training_has_its_golden_digest(monkeypatch, profile, method):
    use_shared_code(monkeypatch, METHODS[profile][method])
    digest = training_digest(profile, method)
    assert digest == GOLDEN['trainings'][profile][method], CHANGED.format(method, digest)


@pytest.mark.parametrize('method', METHODS['published'])
def test_a_short_training_in_a_table_has_its_golden_digest(monkeypatch, method):
    use_plain_kernels(monkeypatch)  # test_training.py: in any table, they give the compiled bits
    digest = training_digest('published', method, source=machine())
    assert digest == GOLDEN['tables'][method], CHANGED.format(method, digest)


@pytest.mark.parametrize('advising', ADVISING_MODES)
def test_a_short_training_with_a_budget_has_its_golden_digest(advising):
    digest = training_digest('published', 'explicit', BUDGET, advising)
    assert digest == GOLDEN['budgets'][advising], CHANGED.format(advising, digest)


@pytest.mark.parametrize('text', GOLDEN['mentors'])
def test_a_mentor_has_its_golden_digest(text):
    spec, world = parse_mentor_spec(text), World(read_map(MAP, 'published'))
    policy = sparse_policy(make_policy(spec, world, SEED), world, spec.coverage, SEED)
    digest = hashlib.sha256(policy.tobytes()).hexdigest()
    assert digest == GOLDEN['mentors'][text], CHANGED.format(text, digest)


def test_every_golden_digest_belongs_to_a_preset():
    assert {(profile, method) for profile in GOLDEN['trainings']
            for method in GOLDEN['trainings'][profile]} == set(ROWS)
