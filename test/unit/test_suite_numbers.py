# SPDX-License-Identifier: Apache-2.0
"""The rules of the suite, on invented regrets."""

import numpy as np
import pytest

from comply_ros.experiments.computed_results import Results
from comply_ros.experiments.suite_numbers import (
    ablation_numbers,
    count_rule,
    holds,
    is_clear,
    last_returns,
    world_numbers,
)
from comply_ros.experiments.suite_runs import MENTORS, SuiteWorld
from comply_ros.experiments.training_runs import Run

REGRETS = {'none': [100.0, 100.0], 'optimal': [0.0, 0.0], 'noisy:0.3': [125.0, 125.4],
           'snapshot:0.75': [60.0, 200.0], 'random': [140.0, 140.5], 'adversarial': [90.0, 90.0],
           'q_learning': [300.0, 300.0], 'watkins': [80.0, 130.0], 'sarsa_lambda': [110.0, 112.0]}


class Invented(Results):
    """Invented regrets, by the mentor of model_based and by the names of the other methods."""

    def __init__(self):
        super().__init__(None, 'published')

    def measured(self, run, name):
        """Return the regrets of two seeds."""
        assert name == 'regret'
        return REGRETS[run.mentor if run.method == 'model_based' else run.method]

    def counted(self, run):
        """Return a curve of 60 iterations for each of two seeds."""
        return np.array([[-200.0] * 10 + [-150.0] * 50, [-200.0] * 10 + [-140.0] * 50])


@pytest.fixture(scope='module')
def numbers():
    return world_numbers(Invented(), SuiteWorld('bar_grid', True))


def test_a_mentor_may_cost_a_quarter_more_than_none(numbers):
    # 1.25 x 100 = 125: 125.2 is 125 in whole numbers; 130 and 140.25 are more.
    assert {mentor: numbers['holds'][mentor] for mentor in MENTORS} == {
        'optimal': True, 'noisy:0.3': True, 'snapshot:0.75': False, 'random': False,
        'adversarial': True}


def test_the_best_other_method_is_that_with_the_lowest_mean(numbers):
    assert numbers['best'] == 'watkins'  # (80 + 130) / 2 = 105
    assert numbers['holds']['alone']  # 100 <= 105
    assert (numbers['map'], numbers['held_out'], numbers['states']) == ('bar_grid', True, 121)


def test_a_rule_is_broken_clearly_where_the_seeds_agree(numbers):
    # random is 15 and 15.5 above its bound; snapshot:0.75 is 65 below and 75 above.
    assert {rule: clear for rule, clear in numbers['clear'].items() if clear} == {'random': True}


def test_the_interval_of_one_seed_says_nothing():
    assert not is_clear([9.0], [1.0])
    assert is_clear([9.0, 9.1], [1.0, 1.0])


def test_no_regret_is_not_more_than_none():
    assert holds([1e-12], [0.0])


def test_worlds_are_counted(numbers):
    kept = {**numbers, 'holds': dict.fromkeys(numbers['holds'], True)}
    assert count_rule([numbers, kept], 'all') == (1, 2)
    assert count_rule([numbers, kept], 'random') == (1, 2)
    assert count_rule([numbers, kept], 'alone') == (2, 2)
    assert count_rule([], 'all') == (0, 0)


def test_the_last_fifty_iterations_are_those_of_the_car():
    value = last_returns(Invented(), {'swing': Run()})['swing']
    assert value['mean'] == -145.0
    assert value['low'] < -150.0 < -140.0 < value['high']  # two seeds


def test_parts_are_ordered_by_probability_and_mentor():
    run = Run('maze', method='model_based')
    numbers = ablation_numbers(Invented(), {
        (0.95, 'model_based', 'none'): run, (0.7, 'no slack', 'none'): run,
        (0.7, 'no slack', 'optimal'): run._replace(mentor='optimal')})
    assert numbers['0.7']['no slack']['optimal']['mean'] == 0.0
    assert numbers['0.95'] == {'model_based': {'none': {
        'mean': 100.0, 'low': 100.0, 'high': 100.0}}}
