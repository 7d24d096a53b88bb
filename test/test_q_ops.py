# SPDX-License-Identifier: Apache-2.0
"""What can be asked of the action values of one state."""

from tiny_worlds import Bench, corridor, room

from comply_ros.numerics.q_ops import count_untried, max_q_except, NOTHING
from comply_ros.world.grid import RIGHT


def test_the_highest_other_value(as_run):
    bench = Bench(room())
    bench.memory.q[4] = [1.0, 3.0, 2.0, -1.0]
    assert as_run(max_q_except)(4, RIGHT, bench.memory.q) == 2.0
    assert as_run(max_q_except)(4, -1, bench.memory.q) == 3.0
    assert as_run(max_q_except)(0, RIGHT, Bench(corridor()).memory.q) == NOTHING


def test_an_action_that_the_cell_has_not_is_not_untried(as_run):
    bench = Bench(room())
    assert as_run(count_untried)(0, bench.memory.q, bench.memory.visits) == 2
    bench.memory.visits[0, RIGHT] = 2.0
    assert as_run(count_untried)(0, bench.memory.q, bench.memory.visits) == 1
