# SPDX-License-Identifier: Apache-2.0
"""Journals: what was packed comes back, and nothing else ever does."""

from typing import NamedTuple

from hypothesis import given
from hypothesis import strategies as st
import pytest

from comply_ros.storage.message_journal import DamagedError, JournalCodec
from examples import examples

fuzz = examples(100)


class Large(NamedTuple):
    """A tuple of numbers, as those of the protocol."""

    number: int
    reward: float
    done: bool


class Small(NamedTuple):
    """A shorter one."""

    action: int


KINDS, SEED = (Large, Small), b'a digest'
ENTRIES = [Large(1, -0.5, False), Small(3), Small(-1), Large(2 ** 40, 1e300, True),
           Large(0, 0.0, False), Small(0), Large(7, 2.0, True)]


def packed(entries, seed=SEED):
    """Return the bytes of each tuple."""
    codec = JournalCodec(KINDS, seed)
    return [codec.pack(entry) for entry in entries]


def unpacked(content, seed=SEED):
    """Return what is in bytes, and how many of them it takes."""
    return JournalCodec(KINDS, seed).unpack(content)


PARTS = packed(ENTRIES)
CONTENT = b''.join(PARTS)
ENDS = [sum(map(len, PARTS[:count])) for count in range(len(PARTS) + 1)]
any_entry = st.one_of(
    st.builds(Large, st.integers(-2 ** 63, 2 ** 63 - 1), st.floats(allow_nan=False),
              st.booleans()),
    st.builds(Small, st.integers(-2 ** 63, 2 ** 63 - 1)))


@fuzz
@given(st.lists(any_entry), st.binary())
def test_what_was_packed_comes_back_to_the_bit(entries, seed):
    content = b''.join(packed(entries, seed))
    again, size = unpacked(content, seed)
    assert again == entries and size == len(content)
    assert [type(entry) for entry in again] == [type(entry) for entry in entries]
    assert b''.join(packed(again, seed)) == content


def test_a_record_has_a_byte_for_its_kind_its_fields_and_four_bytes_for_its_checksum():
    assert [len(part) for part in PARTS[:2]] == [1 + 8 + 8 + 1 + 4, 1 + 8 + 4]


def test_records_cut_at_any_byte_are_read_up_to_the_last_whole_one():
    for size in range(len(CONTENT) + 1):
        whole = max(count for count, end in enumerate(ENDS) if end <= size)
        assert unpacked(CONTENT[:size]) == (ENTRIES[:whole], ENDS[whole])


@pytest.mark.parametrize('zeros', [1, 3, 4, 13, 22, 4096])
def test_zeros_after_a_cut_as_a_loss_of_power_leaves_them_are_left_out(zeros):
    for size in range(len(CONTENT) + 1):
        content = CONTENT[:size] + bytes(zeros)
        # Zeros at the end of a record may be those that were cut off.
        whole = max(count for count, end in enumerate(ENDS) if content[:end] == CONTENT[:end])
        assert unpacked(content) == (ENTRIES[:whole], ENDS[whole])


def test_records_appended_after_the_last_whole_one_can_be_read():
    codec = JournalCodec(KINDS, SEED)
    entries, end = codec.unpack(CONTENT[:-1])
    more = codec.pack(Small(5))
    assert unpacked(CONTENT[:end] + more) == ([*entries, Small(5)], end + len(more))


def test_a_flipped_bit_is_an_error_or_costs_the_last_record():
    for bit in range(8 * len(CONTENT)):
        spoiled = bytearray(CONTENT)
        spoiled[bit // 8] ^= 1 << bit % 8
        try:
            entries, end = unpacked(bytes(spoiled))
        except DamagedError as error:
            assert str(error).isprintable()
        else:
            assert entries == ENTRIES[:-1] and end == ENDS[-2] and bit // 8 >= end


@pytest.mark.parametrize('order', [(1, 0, *range(2, 7)), (0, 2, 1, *range(3, 7)), (1, 2, 3),
                                   (0, 2, 3), (0, 0, 1), (0, 1, 2, 4, 5), (6, 6, 6)])
def test_records_that_were_moved_left_out_or_doubled_are_damage(order):
    with pytest.raises(DamagedError, match=r'record \d at byte \d+ does not match its checksum'):
        unpacked(b''.join(PARTS[number] for number in order))


def test_records_after_another_seed_are_damage():
    with pytest.raises(DamagedError, match='record 1 at byte 0 does not match'):
        unpacked(CONTENT, b'another digest')


def test_an_unknown_kind_is_damage():
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
def test_spoiled_bytes_are_never_read_as_other_entries(data):
    spoiled = bytearray(CONTENT)
    for _ in range(data.draw(st.integers(1, 3))):
        begin = data.draw(st.integers(0, len(spoiled)))
        spoiled[begin:begin + data.draw(st.integers(0, 30))] = data.draw(st.binary(max_size=30))
    try:
        entries, end = unpacked(bytes(spoiled))
    except DamagedError:
        return
    assert entries == ENTRIES[:len(entries)] and bytes(spoiled[:end]) == CONTENT[:end]
