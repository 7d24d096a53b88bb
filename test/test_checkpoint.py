# SPDX-License-Identifier: Apache-2.0
"""Snapshots: what was packed comes back to the bit, and any other bytes are refused."""

import os

from hypothesis import example, given, HealthCheck, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from comply_ros.storage.checkpoint import MAGIC, pack_snapshot, SnapshotError, unpack_snapshot

settings.register_profile('snapshots', deadline=None, max_examples=200, database=None,
                          derandomize=os.environ.get('CI') == 'true',
                          suppress_health_check=list(HealthCheck))
fuzz = settings(settings.get_profile('snapshots'))
FACTS = {'steps': 2 ** 60, 'return': -1.0 / 3.0, 'last': [1, 2, None, True], 'word': 'ü\n'}
ARRAYS = {'q': np.array([[0.1, -np.inf], [np.nan, -0.0]]), 'trail': np.arange(3),
          'none': np.zeros((0, 4))}
DIGEST, CONTENT = pack_snapshot(FACTS, ARRAYS)


def test_what_was_packed_comes_back_to_the_bit():
    digest, facts, arrays = unpack_snapshot(CONTENT)
    assert (digest, facts) == (DIGEST, FACTS)
    assert list(arrays) == list(ARRAYS)
    for name, array in ARRAYS.items():
        assert (arrays[name].dtype, arrays[name].shape) == (array.dtype, array.shape)
        assert arrays[name].tobytes() == array.tobytes()


def test_numbers_that_json_does_not_know_come_back_too():
    _, facts, _ = unpack_snapshot(pack_snapshot({'no': float('nan'), 'low': -np.inf}, {})[1])
    assert repr(facts) == "{'no': nan, 'low': -inf}"


def test_the_same_state_has_the_same_digest_and_another_has_another():
    assert pack_snapshot(FACTS, ARRAYS) == (DIGEST, CONTENT)
    assert pack_snapshot({**FACTS, 'steps': 1}, ARRAYS)[0] != DIGEST
    assert pack_snapshot(FACTS, {**ARRAYS, 'trail': np.arange(1, 4)})[0] != DIGEST


def test_the_beginning_of_a_snapshot_is_refused():
    for size in range(len(CONTENT)):
        with pytest.raises(SnapshotError):
            unpack_snapshot(CONTENT[:size])


@fuzz
@given(st.integers(0, 8 * len(CONTENT) - 1))
@example(0)
@example(8 * len(MAGIC))
@example(8 * (len(MAGIC) + 64))
@example(8 * len(CONTENT) - 1)
def test_a_flipped_bit_is_an_error_of_one_line(bit):
    spoiled = bytearray(CONTENT)
    spoiled[bit // 8] ^= 1 << bit % 8
    with pytest.raises(SnapshotError) as error:
        unpack_snapshot(bytes(spoiled))
    assert str(error.value).isprintable()


@fuzz
@given(st.one_of(st.binary(), st.binary().map(lambda rest: MAGIC + rest),
                 st.integers(0, len(CONTENT) - 1).map(lambda size: CONTENT[:size]),
                 st.binary(min_size=1).map(lambda more: CONTENT + more)))
@example(b'')
@example(MAGIC)
def test_other_bytes_are_an_error_of_one_line(content):
    with pytest.raises(SnapshotError) as error:
        unpack_snapshot(content)
    assert str(error.value).isprintable()


def test_the_snapshot_of_another_format_is_refused_by_its_first_line():
    with pytest.raises(SnapshotError, match="must begin with 'comply_ros snapshot 1', got "
                                            "b'comply_ros snapshot 2"):
        unpack_snapshot(CONTENT.replace(b'snapshot 1', b'snapshot 2', 1))
