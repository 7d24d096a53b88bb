# SPDX-License-Identifier: Apache-2.0
"""Worlds without a model: states and actions, and nothing else."""

import hashlib
import struct

import numpy as np
import pytest

from comply_ros.world.grid import MapError
from comply_ros.world.state_action_spaces import Spaces


def test_the_hash_is_that_of_the_bytes_that_are_described():
    data = b'comply_ros spaces 1\n' + struct.pack('<q', 2)
    data += struct.pack('<q', 2) + b'go' + struct.pack('<q', 4) + b'wait'
    data += struct.pack('<2q', 3, 10)
    expected = hashlib.sha256(data + bytes(6 * [1])).hexdigest()
    assert Spaces(3, ('go', 'wait'), 10).sha256 == expected
    assert Spaces(3, ('go', 'wait'), 10, np.ones((3, 2), dtype=bool)).sha256 == expected


def test_spaces_are_equal_if_their_hashes_are():
    some = np.array([[True, True], [True, False], [True, True]])
    assert Spaces(3, ('go', 'wait'), 10) == Spaces(3, ('go', 'wait'), 10)
    assert len({Spaces(3, ('go', 'wait'), 10), Spaces(3, ('go', 'wait'), 10, some),
                Spaces(3, ('go', 'wait'), 11), Spaces(4, ('go', 'wait'), 10),
                Spaces(3, ('go', 'stop'), 10)}) == 5


@pytest.mark.parametrize('arguments, message', [
    ((0, ('go',), 10), 'a world must have at least one state, and at most 2147483647 pairs of a '
     'state and an action, got 0 states'),
    ((2 ** 31, ('go',), 10), 'got 2147483648 states'),
    ((3, (), 10), 'a world must have 1 to 32767 actions, got 0'),
    ((3, ('go',), 0), 'step_limit must be a whole number in [1, 1000000], got 0'),
    ((3, ('go',), 10, np.ones((3, 2), dtype=bool)),
     'available must be bool of shape (3, 1), got bool of shape (3, 2)'),
    ((3, ('go',), 10, np.zeros((3, 1), dtype=bool)),
     'a world must have a state with an action, got none')])
def test_what_cannot_be_is_rejected(arguments, message):
    with pytest.raises(MapError) as error:
        Spaces(*arguments)
    assert message in str(error.value)
