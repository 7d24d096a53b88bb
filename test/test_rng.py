# SPDX-License-Identifier: Apache-2.0
"""Random numbers as an argument."""

import numpy as np

from comply_ros.numerics.rng import BLOCK, random_streams, UniformRows


def test_rows_and_blocks_give_the_same_numbers():
    by_row, by_block = UniformRows(random_streams(5)[1], 2), UniformRows(random_streams(5)[1], 2)
    rows = [by_row.row() for _ in range(BLOCK + 3)]
    taken = []
    while len(taken) < len(rows):
        block = by_block.block()[:1000]
        taken += block.tolist()
        by_block.use(len(block))
    assert taken[:len(rows)] == rows


def test_a_block_that_was_not_used_up_comes_again():
    draws = UniformRows(random_streams(0)[0], 1)
    first = draws.block()[10, 0]
    draws.use(10)
    assert draws.block()[0, 0] == first


def test_the_position_is_a_function_of_the_row():
    generator = random_streams(9)[1]
    generator.bit_generator.advance(2 * 777)
    draws = UniformRows(random_streams(9)[1], 2)
    rows = [draws.row() for _ in range(778)]
    assert rows[777] == generator.random(2).tolist()


def test_world_and_learner_draw_independently():
    world, learner = random_streams(1)
    assert abs(np.corrcoef(world.random(4000), learner.random(4000))[0, 1]) < 0.05
