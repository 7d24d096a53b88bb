# SPDX-License-Identifier: Apache-2.0
"""Records: what was packed comes back, and nothing else ever does."""

import os
from typing import NamedTuple

from hypothesis import given, HealthCheck, settings
from hypothesis import strategies as st
import pytest

from comply_ros.storage.journal import DamagedError, JournalCodec

settings.register_profile('records', deadline=None, max_examples=200, database=None,
                          derandomize=os.environ.get('CI') == 'true',
                          suppress_health_check=list(HealthCheck))
fuzz = settings(settings.get_profile('records'))


class Step(NamedTuple):
    """A tuple of numbers, as those of the conversation."""

    number: int
    reward: float
    done: bool


class Word(NamedTuple):
    """A shorter one."""

    action: int


KINDS, SEED = (Step, Word), b'a digest'
TOLD = [Step(1, -0.5, False), Word(3), Word(-1), Step(2 ** 40, 1e300, True), Step(0, 0.0, False),
        Word(0), Step(7, 2.0, True)]


def packed(told, seed=SEED):
    """Return the bytes of each tuple."""
    records = JournalCodec(KINDS, seed)
    return [records.pack(msg) for msg in told]


def unpacked(content, seed=SEED):
    """Return what is in bytes, and how many of them it takes."""
    return JournalCodec(KINDS, seed).unpack(content)


PARTS = packed(TOLD)
CONTENT = b''.join(PARTS)
ENDS = [sum(map(len, PARTS[:count])) for count in range(len(PARTS) + 1)]
anything = st.one_of(
    st.builds(Step, st.integers(-2 ** 63, 2 ** 63 - 1), st.floats(allow_nan=False), st.booleans()),
    st.builds(Word, st.integers(-2 ** 63, 2 ** 63 - 1)))


@fuzz
@given(st.lists(anything), st.binary())
def test_what_was_packed_comes_back_to_the_bit(told, seed):
    content = b''.join(packed(told, seed))
    again, size = unpacked(content, seed)
    assert again == told and size == len(content)
    assert [type(msg) for msg in again] == [type(msg) for msg in told]
    assert b''.join(packed(again, seed)) == content


def test_a_record_has_a_byte_for_its_kind_eight_for_a_number_one_for_a_truth_and_four_to_seal_it():
    assert [len(part) for part in PARTS[:2]] == [1 + 8 + 8 + 1 + 4, 1 + 8 + 4]


def test_records_cut_at_any_byte_are_used_up_to_the_last_whole_one():
    for size in range(len(CONTENT) + 1):
        whole = max(count for count, end in enumerate(ENDS) if end <= size)
        assert unpacked(CONTENT[:size]) == (TOLD[:whole], ENDS[whole])


@pytest.mark.parametrize('zeros', [1, 3, 4, 13, 22, 4096])
def test_zeros_behind_a_cut_are_what_a_loss_of_power_leaves(zeros):
    for size in range(len(CONTENT) + 1):
        content = CONTENT[:size] + bytes(zeros)
        # Zeros at the end of a record may be those that were cut off.
        whole = max(count for count, end in enumerate(ENDS) if content[:end] == CONTENT[:end])
        assert unpacked(content) == (TOLD[:whole], ENDS[whole])


def test_who_goes_on_behind_the_last_whole_record_can_read_all_of_it():
    records = JournalCodec(KINDS, SEED)
    told, end = records.unpack(CONTENT[:-1])
    more = records.pack(Word(5))
    assert unpacked(CONTENT[:end] + more) == ([*told, Word(5)], end + len(more))


def test_a_flipped_bit_is_an_error_or_at_the_end_a_record_less():
    for bit in range(8 * len(CONTENT)):
        spoiled = bytearray(CONTENT)
        spoiled[bit // 8] ^= 1 << bit % 8
        try:
            told, end = unpacked(bytes(spoiled))
        except DamagedError as error:
            assert str(error).isprintable()
        else:
            assert told == TOLD[:-1] and end == ENDS[-2] and bit // 8 >= end


@pytest.mark.parametrize('order', [(1, 0, *range(2, 7)), (0, 2, 1, *range(3, 7)), (1, 2, 3),
                                   (0, 2, 3), (0, 0, 1), (0, 1, 2, 4, 5), (6, 6, 6)])
def test_records_that_were_moved_left_out_or_said_twice_are_damage(order):
    with pytest.raises(DamagedError, match=r'record \d at byte \d+ does not fit its checksum'):
        unpacked(b''.join(PARTS[number] for number in order))


def test_records_behind_another_seed_are_damage():
    with pytest.raises(DamagedError, match='record 1 at byte 0 does not fit'):
        unpacked(CONTENT, b'another digest')


def test_a_kind_that_there_is_not_is_damage():
    with pytest.raises(DamagedError, match='there is no record of kind 2, at byte 22'):
        unpacked(PARTS[0] + b'\2')


@fuzz
@given(st.binary())
def test_random_bytes_are_an_error_or_nothing(content):
    try:
        assert unpacked(content) == ([], 0)
    except DamagedError as error:
        assert str(error).isprintable()


@fuzz
@given(st.data())
def test_spoiled_bytes_are_never_taken_for_something_that_was_not_said(data):
    spoiled = bytearray(CONTENT)
    for _ in range(data.draw(st.integers(1, 3))):
        begin = data.draw(st.integers(0, len(spoiled)))
        spoiled[begin:begin + data.draw(st.integers(0, 30))] = data.draw(st.binary(max_size=30))
    try:
        told, end = unpacked(bytes(spoiled))
    except DamagedError:
        return
    assert told == TOLD[:len(told)] and bytes(spoiled[:end]) == CONTENT[:end]
