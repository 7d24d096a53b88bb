# SPDX-License-Identifier: Apache-2.0
"""Operations on the action values of one state."""

from tiny_worlds import Bench, corridor, room

from comply_ros.numerics.q_ops import count_untried, max_q_except, NOTHING
from comply_ros.world.grid import RIGHT


def test_the_highest_other_value(as_run):
    bench = Bench(room())
    bench.state.q[4] = [1.0, 3.0, 2.0, -1.0]
    assert as_run(max_q_except)(4, RIGHT, bench.state.q) == 2.0
    assert as_run(max_q_except)(4, -1, bench.state.q) == 3.0
    assert as_run(max_q_except)(0, RIGHT, Bench(corridor()).state.q) == NOTHING


def test_an_action_that_the_state_does_not_have_does_not_count_as_untried(as_run):
    bench = Bench(room())
    assert as_run(count_untried)(0, bench.state.q, bench.state.visits) == 2
    bench.state.visits[0, RIGHT] = 2.0
    assert as_run(count_untried)(0, bench.state.q, bench.state.visits) == 1
