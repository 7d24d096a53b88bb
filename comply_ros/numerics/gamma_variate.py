# SPDX-License-Identifier: Apache-2.0
"""Gamma variates in kernels, from a generator whose state is one whole number."""

import math

from comply_ros.numerics.jit import kernel

# Multiply with carry, as in KISS (Marsaglia, 1999): a word has a number in its lower 32 bits and
# the carry above, and stays below 2^62. MULTIPLIER 2^32 - 1 is a prime: the period is half of it.
MULTIPLIER = 698769069
RANGE = 2 ** 32
MASK = RANGE - 1


@kernel
def generator_from(u: float, v: float) -> int:
    """Return a word of the generator from two uniforms in [0, 1), never a fixed point of it."""
    return (1 + int(u * (MULTIPLIER - 2))) * RANGE + int(v * RANGE)


@kernel
def next_word(word: int) -> int:
    """Return the word after this one."""
    return MULTIPLIER * (word & MASK) + (word >> 32)


@kernel
def uniform_of(word: int) -> float:
    """Return the uniform of a word, in (0, 1)."""
    return (float(word & MASK) + 0.5) / RANGE


@kernel
def normal_variate(word: int) -> tuple[float, int]:
    """Return a standard normal variate, and the next word: polar method (Marsaglia, 1964)."""
    while True:
        word = next_word(word)
        x = 2.0 * uniform_of(word) - 1.0
        word = next_word(word)
        y = 2.0 * uniform_of(word) - 1.0
        square = x * x + y * y
        if 0.0 < square < 1.0:
            return x * math.sqrt(-2.0 * math.log(square) / square), word


@kernel
def gamma_variate(shape: float, word: int) -> tuple[float, int]:
    """
    Return a gamma variate of a shape above 0 and scale 1, and the next word.

    Marsaglia and Tsang (2000); a shape below 1 by the variate of the shape above it.
    """
    above = shape if shape >= 1.0 else shape + 1.0
    d = above - 1.0 / 3.0
    while True:
        x, word = normal_variate(word)
        v = 1.0 + x / math.sqrt(9.0 * d)
        v = v * v * v
        word = next_word(word)
        if v > 0.0 and math.log(uniform_of(word)) < 0.5 * x * x + d - d * v + d * math.log(v):
            break
    if shape >= 1.0:
        return d * v, word
    word = next_word(word)
    return d * v * math.pow(uniform_of(word), 1.0 / shape), word
