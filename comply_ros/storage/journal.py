# SPDX-License-Identifier: Apache-2.0
"""Tuples as records of a journal, each sealed by a checksum over all that came before it."""

from struct import Struct
from typing import get_type_hints
from zlib import crc32

CODES = {int: 'q', float: 'd', bool: '?'}
SEAL = Struct('<I')


class DamagedError(ValueError):
    """A journal that was changed after it was written; the message says where."""


class JournalCodec:
    """
    Writes tuples of numbers as bytes, and reads them back.

    A record is the index of its kind (1 byte), its fields (8 bytes a number, 1 a truth) and a
    CRC-32 of them and of all records before, so none can be changed, left out or moved unseen.

    Parameters
    ----------
    kinds: the NamedTuples that there are.
    seed: bytes that the first checksum begins with.

    """

    def __init__(self, kinds, seed):
        self._kinds, self._sum = kinds, crc32(seed)
        self._structs = [_struct_of(kind) for kind in kinds]
        self._index = {kind: (number, struct.pack)
                       for number, (kind, struct) in enumerate(zip(kinds, self._structs))}

    def pack(self, msg):
        """Return the bytes of the next record."""
        number, pack = self._index[type(msg)]
        content = pack(number, *msg)
        self._sum = crc32(content, self._sum)
        return content + SEAL.pack(self._sum)

    def unpack(self, content):
        """
        Return the tuples in bytes, and how many of the bytes they take: up to the last whole one.

        What a kill or a loss of power leaves at the end, part of a record, zeros, or both, is left
        out.

        Raises
        ------
        DamagedError: if a whole record does not fit its checksum.

        """
        told, place, filled = [], 0, len(content.rstrip(b'\0'))
        while place < len(content):
            record = self._next(content, place)
            if record is None:
                break
            msg, size, seal = record
            expected = crc32(content[place:place + size], self._sum)
            if expected != seal and filled < place + size + SEAL.size:
                break
            if expected != seal:
                raise DamagedError(f'record {len(told) + 1} at byte {place} does not fit its '
                                   'checksum')
            self._sum = expected
            told.append(msg)
            place += size + SEAL.size
        return told, place

    def _next(self, content, place):
        """Return tuple, size and seal of the record at a place; None if it was never finished."""
        number = content[place]
        if number >= len(self._kinds):
            raise DamagedError(f'there is no record of kind {number}, at byte {place}')
        struct = self._structs[number]
        rest = content[place:place + struct.size + SEAL.size]
        if len(rest) < struct.size + SEAL.size:
            return None
        return (self._kinds[number](*struct.unpack_from(rest)[1:]), struct.size,
                SEAL.unpack_from(rest, struct.size)[0])


def _struct_of(kind):
    return Struct('<B' + ''.join(CODES[hint] for hint in get_type_hints(kind).values()))
