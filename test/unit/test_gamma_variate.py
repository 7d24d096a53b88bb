# SPDX-License-Identifier: Apache-2.0
"""Gamma variates of kernels: their generator by hand, their distribution by its moments."""

import numpy as np
import pytest

from comply_ros.numerics.gamma_variate import (
    gamma_variate,
    generator_from,
    MULTIPLIER,
    next_word,
    normal_variate,
    RANGE,
    uniform_of,
)
from comply_ros.numerics.jit import compiled


def variates(as_run, number, kernel, *arguments):
    """Return variates of a kernel, one after the other."""
    word, found, run = as_run(generator_from)(0.25, 0.5), [], as_run(kernel)
    for _ in range(number):
        value, word = run(*arguments, word)
        found.append(value)
    return np.array(found)


def test_the_next_word_is_multiplied_and_gets_the_carry(as_run):  # number 5, carry 3
    word = as_run(next_word)(3 * RANGE + 5)
    assert word == 5 * 698769069 + 3 == 3493845348
    assert as_run(uniform_of)(word) == 3493845348.5 / 4294967296
    assert as_run(next_word)(7 * RANGE + 4294967295) == 4294967295 * 698769069 + 7


def test_the_first_word_is_made_of_two_uniforms_and_never_stays_where_it_is(as_run):
    assert as_run(generator_from)(0.0, 0.5) == RANGE + RANGE // 2
    for u, v in ((0.0, 0.0), (1.0 - 2 ** -53, 1.0 - 2 ** -53)):
        word = as_run(generator_from)(u, v)
        assert as_run(next_word)(word) != word
        assert 0 < word < MULTIPLIER * RANGE - 1


def test_a_uniform_is_never_0_or_1(as_run):
    assert 0.0 < as_run(uniform_of)(RANGE) < as_run(uniform_of)(2 * RANGE - 1) < 1.0


def test_normal_variates_have_mean_0_and_variance_1(as_run):
    found = variates(as_run, 20_000, normal_variate)
    assert (found.mean(), found.var()) == pytest.approx((0.0, 1.0), abs=0.03)
    assert (found ** 4).mean() == pytest.approx(3.0, abs=0.2)


@pytest.mark.parametrize('shape', [0.1, 0.7, 1.0, 5.0, 300.0])
def test_gamma_variates_have_mean_and_variance_of_their_shape(as_run, shape):
    found = variates(as_run, 20_000, gamma_variate, shape) / shape
    assert found.min() >= 0.0
    assert found.mean() == pytest.approx(1.0, abs=0.03 * max(1.0, shape ** -0.5))
    assert found.var() * shape == pytest.approx(1.0, abs=0.12)


def test_the_bits_are_those_of_plain_python():
    for shape in (0.1, 1.0, 7.0):
        plain = variates(lambda kernel: kernel, 500, gamma_variate, shape)
        assert (variates(compiled, 500, gamma_variate, shape) == plain).all()
