# SPDX-License-Identifier: Apache-2.0
"""A mentor that is exchanged half way: what the learner is given, and who notices it."""

import numpy as np
import pytest

from comply_ros.experiments.extra_curves import exchange_curves
from comply_ros.experiments.training_runs import learn, Run

SHORT = (('episodes', 5), ('iterations', 60))


def exchanged(method, mentors, seeds=3, settings=SHORT):
    """Return the curves of an exchange in `bar_grid`."""
    return exchange_curves(Run('bar_grid', 'published', method, settings, mentors), seeds)


def test_until_the_exchange_the_learner_is_one_with_the_first_mentor():
    curves = exchanged('explicit', 'optimal + adversarial', seeds=2)
    assert curves.returns.shape == curves.confidences.shape == (2, 60)
    assert curves.exchanged == 30
    for seed in (0, 1):
        alone = learn(Run('bar_grid', 'published', 'explicit', SHORT, 'optimal', seed=seed))
        assert curves.returns[seed, :30].tolist() == alone.returns[:30]
        assert curves.returns[seed, 30:].tolist() != alone.returns[30:]


def test_the_second_mentor_is_the_one_that_has_the_next_seed():
    second = 'noisy:0.5'  # another policy for each seed
    with_it, itself = (exchanged('constant', f'{first} + {second}', seeds=1, settings=(
        ('episodes', 5), ('iterations', 2), ('measuring_iterations', 2)))
        for first in ('optimal', second))
    assert with_it.returns[0, 0] != itself.returns[0, 0]
    assert with_it.exchanged == 1


@pytest.mark.parametrize('method, before, after', [
    ('model_based', 0.9, 0.1), ('beta_implicit', 0.8, 0.6), ('explicit', 0.6, 0.3)])
def test_confidence_falls_where_the_mentor_becomes_bad(method, before, after):
    curves = exchanged(method, 'optimal + adversarial')
    means = curves.confidences.mean(axis=0)
    assert means[20:30].mean() > before
    assert means[50:].mean() < after


@pytest.mark.parametrize('method, before, after', [
    ('model_based', 0.1, 0.7), ('explicit', 0.3, 0.6)])
def test_confidence_rises_where_the_mentor_becomes_good(method, before, after):
    means = exchanged(method, 'adversarial + optimal').confidences.mean(axis=0)
    assert means[20:30].mean() < before
    assert means[50:].mean() > after


def test_a_constant_confidence_notices_nothing():
    confidences = exchanged('constant', 'optimal + adversarial').confidences
    assert confidences == pytest.approx(np.full((3, 60), 0.9))


def test_an_exchange_needs_two_mentors():
    with pytest.raises(ValueError):
        exchanged('constant', 'optimal', seeds=1)
