# SPDX-License-Identifier: Apache-2.0
"""Random numbers: independent streams, and rows of uniforms by number."""

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


def test_the_unused_rest_of_a_block_comes_again():
    draws = UniformRows(random_streams(0)[0], 1)
    first = draws.block()[10, 0]
    draws.use(10)
    assert draws.block()[0, 0] == first


def test_the_position_in_the_stream_is_a_function_of_the_row():
    generator = random_streams(9)[1]
    generator.bit_generator.advance(2 * 777)
    draws = UniformRows(random_streams(9)[1], 2)
    rows = [draws.row() for _ in range(778)]
    assert rows[777] == generator.random(2).tolist()


def test_skipped_rows_are_the_same_as_used_ones():
    used, skipped = UniformRows(random_streams(9)[1], 2), UniformRows(random_streams(9)[1], 2)
    for _ in range(BLOCK + 7):
        used.row()
    skipped.skip_to(BLOCK + 7)
    assert skipped.used == used.used == BLOCK + 7
    assert skipped.row() == used.row()


def test_world_and_learner_draw_independently():
    world, learner = random_streams(1)
    assert abs(np.corrcoef(world.random(4000), learner.random(4000))[0, 1]) < 0.05
