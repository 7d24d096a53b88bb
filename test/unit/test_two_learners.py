# SPDX-License-Identifier: Apache-2.0
"""Two learners that teach each other: whose advice they have, the same bits, what it is worth."""

from dataclasses import replace
from pathlib import Path
import runpy

import numpy as np
from tiny_worlds import corridor

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.learner.two_learners import TwoLearners
from comply_ros.storage.map_files import read_map
from comply_ros.world.grid import NO_ACTION, RIGHT
from comply_ros.world.mdp import World

EXAMPLE = Path(__file__).parents[2] / 'examples' / 'two_learners.py'
PI_REUSE = find_method('pi_reuse', 'published')


def test_each_begins_without_advice_and_then_has_the_policy_of_the_other():
    pair = TwoLearners(corridor(), replace(PI_REUSE, episodes=1), (3, 4))
    pair.iterate()
    first, second = pair.trainings
    assert (first.advice == NO_ACTION).all() and (second.advice == NO_ACTION).all()
    assert first.learned().policy[1] == RIGHT  # beside the goal: 1 is the state before it
    pair.iterate()
    assert second.advice[1] == RIGHT  # it was there, and this was the advice


def test_before_the_first_exchange_each_is_a_training_of_its_own():
    config = replace(PI_REUSE, episodes=2)
    pair = TwoLearners(corridor(), config, (3, 4))
    alone = [Training(corridor(), np.full(3, NO_ACTION), config, seed) for seed in (3, 4)]
    for one, other in zip(pair.iterate(), [training.iterate() for training in alone]):
        assert (one.mean_return, one.steps) == (other.mean_return, other.steps)


def test_the_same_seeds_give_the_same_bits_whoever_is_first():
    config = replace(PI_REUSE, episodes=3)
    pairs = [TwoLearners(corridor(), config, seeds) for seeds in ((3, 4), (3, 4), (4, 3))]
    for pair in pairs:
        for _ in range(5):
            pair.iterate()
    digests = [[training.state.digest() for training in pair.trainings] for pair in pairs]
    assert digests[0] == digests[1] == digests[2][::-1]
    assert digests[0][0] != digests[0][1]


def test_in_maze_both_collect_more_than_alone_and_end_better():
    world, config = World(read_map('maze', 'published')), PI_REUSE
    alone, together = [], []
    for seeds in ((9000, 9001), (9002, 9003), (9004, 9005)):
        pair = TwoLearners(world, config, seeds)
        together += zip(*(pair.iterate() for _ in range(config.iterations)))
        for seed in seeds:
            training = Training(world, np.full(world.n_states, NO_ACTION), config, seed)
            alone.append([training.iterate() for _ in range(config.iterations)])
    alone, together = (np.array([[each.mean_return for each in learner] for learner in learners])
                       for learners in (alone, together))
    assert (together.sum(axis=1) > alone.sum(axis=1)).all()
    assert together[:, -50:].mean() > alone[:, -50:].mean()


def test_the_example_prints_how_each_ends_with_the_other_and_alone(capsys):
    runpy.run_path(str(EXAMPLE))['main']('pi_reuse', iterations=2, seeds=(5, 6))
    lines = capsys.readouterr().out.splitlines()
    assert [line[:7] for line in lines] == ['seed 5:', 'seed 6:']
    assert all(' alone -' in line and ', with the other one -' in line for line in lines)
