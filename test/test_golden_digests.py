# SPDX-License-Identifier: Apache-2.0
"""The bits of every learner: digests of short trainings, as they were when this file was made."""

import json
from pathlib import Path

from node_processes import run
import pytest

from comply_ros.learner.presets import METHODS
from comply_ros.learner.snapshot_mentor import make_policy
from comply_ros.learner.training import Training
from comply_ros.mentor.mentor_policies import parse_mentor_spec
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World

GOLDEN = json.loads(Path(__file__).with_name('golden_digests.json').read_text())
ROWS = [(profile, method) for profile in METHODS for method in METHODS[profile]]
MAP, MENTOR, SEED, ITERATIONS = 'bar_grid', 'noisy:0.3', 3, 6


def training_digest(profile, method):
    """Return the digest of a short training of one preset in one profile."""
    world = World(read_map(MAP, profile))
    advice = make_policy(parse_mentor_spec(MENTOR), world, SEED)
    training = Training(world, advice, METHODS[profile][method], SEED)
    for _ in range(ITERATIONS):
        training.iterate()
    return training.state.digest()


@pytest.mark.parametrize(('profile', 'method'), ROWS)
def test_a_short_training_has_its_golden_digest(profile, method):
    assert training_digest(profile, method) == GOLDEN['trainings'][profile][method]


def test_every_golden_digest_belongs_to_a_preset():
    assert {(profile, method) for profile in GOLDEN['trainings']
            for method in GOLDEN['trainings'][profile]} == set(ROWS)


@pytest.mark.usefixtures('domain')
def test_a_lesson_has_its_golden_digest(tmp_path):
    done = run('lesson', *GOLDEN['lesson']['arguments'], '--out', str(tmp_path), timeout=100)
    assert done.returncode == 0, done.stderr
    summary = json.loads((tmp_path / 'summary.json').read_text())
    assert summary['digest'] == GOLDEN['lesson']['digest']
