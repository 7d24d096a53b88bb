# SPDX-License-Identifier: Apache-2.0
"""The arrays of a learner, and their digest."""

import hashlib
import struct

import numpy as np
from tiny_worlds import Bench, corridor

from comply_ros.learner.learner_state import LearnerState


def test_a_fresh_memory_knows_which_actions_there_are():
    memory = Bench(corridor(), initial_value=3.0, trust='beta').memory
    inf = float('inf')
    assert memory.q.tolist() == [[-inf, 3, -inf, -inf], [3, 3, -inf, -inf], [3, -inf, -inf, -inf]]
    assert memory.belief.tolist() == [[8.0, 2.0, 0.0]] * 3
    assert memory.schedule.tolist() == [0.9, 1.0, 1.0, 0.0, -np.inf, 1.0, 1.0, 1.0, 8.0, 2.0]


def test_the_digest_is_over_all_arrays_in_order_little_endian():
    memory = LearnerState(*(np.array([float(number)]) for number in range(8)))
    expected = hashlib.sha256(b''.join(struct.pack('<d', number) for number in range(8)))
    assert memory.digest() == expected.hexdigest()


def test_every_array_counts_in_the_digest():
    for array in range(8):
        memory = Bench(corridor(), replays=True).memory
        before = memory.digest()
        memory.arrays()[array].flat[0] = 7
        assert memory.digest() != before


def test_views_share_the_arrays():
    memory = Bench(corridor()).memory
    memory.views()[0][1, 1] = 7.5
    assert memory.q[1, 1] == 7.5
