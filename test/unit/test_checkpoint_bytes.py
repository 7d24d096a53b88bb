# SPDX-License-Identifier: Apache-2.0
"""Checkpoints: what was packed comes back to the bit, and any other bytes are rejected."""


from hypothesis import example, given
from hypothesis import strategies as st
import numpy as np
import pytest

from comply_ros.storage.checkpoint_bytes import CheckpointError, pack_checkpoint, unpack_checkpoint
from examples import examples

fuzz = examples(100)
FACTS = {'steps': 2 ** 60, 'return': -1.0 / 3.0, 'last': [1, 2, None, True], 'word': 'ü\n'}
ARRAYS = {'q': np.array([[0.1, -np.inf], [np.nan, -0.0]]), 'trail': np.arange(3),
          'none': np.zeros((0, 4))}
DIGEST, CONTENT = pack_checkpoint(FACTS, ARRAYS)
HEADER = CONTENT[:CONTENT.index(b'\n') + 1]


def test_what_was_packed_comes_back_to_the_bit():
    digest, facts, arrays = unpack_checkpoint(CONTENT)
    assert (digest, facts) == (DIGEST, FACTS)
    assert list(arrays) == list(ARRAYS)
    for name, array in ARRAYS.items():
        assert (arrays[name].dtype, arrays[name].shape) == (array.dtype, array.shape)
        assert arrays[name].tobytes() == array.tobytes()


def test_nan_and_infinity_come_back_too():
    _, facts, _ = unpack_checkpoint(pack_checkpoint({'no': float('nan'), 'low': -np.inf}, {})[1])
    assert repr(facts) == "{'no': nan, 'low': -inf}"


def test_the_same_state_has_the_same_digest_and_another_has_another():
    assert pack_checkpoint(FACTS, ARRAYS) == (DIGEST, CONTENT)
    assert pack_checkpoint({**FACTS, 'steps': 1}, ARRAYS)[0] != DIGEST
    assert pack_checkpoint(FACTS, {**ARRAYS, 'trail': np.arange(1, 4)})[0] != DIGEST


def test_a_cut_checkpoint_is_rejected():
    for size in range(len(CONTENT)):
        with pytest.raises(CheckpointError):
            unpack_checkpoint(CONTENT[:size])


@fuzz
@given(st.integers(0, 8 * len(CONTENT) - 1))
@example(0)
@example(8 * len(HEADER))
@example(8 * (len(HEADER) + 64))
@example(8 * len(CONTENT) - 1)
def test_a_flipped_bit_is_an_error_of_one_line(bit):
    spoiled = bytearray(CONTENT)
    spoiled[bit // 8] ^= 1 << bit % 8
    with pytest.raises(CheckpointError) as error:
        unpack_checkpoint(bytes(spoiled))
    assert str(error.value).isprintable()


@fuzz
@given(st.one_of(st.binary(), st.binary().map(lambda rest: HEADER + rest),
                 st.integers(0, len(CONTENT) - 1).map(lambda size: CONTENT[:size]),
                 st.binary(min_size=1).map(lambda more: CONTENT + more)))
@example(b'')
@example(HEADER)
def test_other_bytes_are_an_error_of_one_line(content):
    with pytest.raises(CheckpointError) as error:
        unpack_checkpoint(content)
    assert str(error.value).isprintable()


@pytest.mark.parametrize('own, other, problem', [
    (b'format 3', b'format 1', 'was written by an older version of comply_ros (format 1; this one '
     'reads format 3)'),
    (b'format 3', b'format 10', 'was written by a newer version of comply_ros (format 10; this '
     'one reads format 3)'),
    (b'algorithm 1', b'algorithm 0', 'was written by an older version of comply_ros (algorithm 0; '
     'this one reads algorithm 1), so its bits would differ'),
    (b'checkpoint', b'snapshot', "must begin with 'comply_ros checkpoint' and its versions, got "
     "b'comply_ros snapshot, format 3, algorithm 1'")])
def test_a_checkpoint_with_another_header_is_rejected_with_the_reason(own, other, problem):
    assert own in HEADER
    with pytest.raises(CheckpointError) as error:
        unpack_checkpoint(CONTENT.replace(own, other, 1))
    assert str(error.value) == problem
