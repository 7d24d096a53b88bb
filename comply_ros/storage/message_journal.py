# SPDX-License-Identifier: Apache-2.0
"""Tuples as records of a journal, each with a checksum over all that came before it."""

from collections.abc import Sequence
from struct import Struct
from typing import Any, get_type_hints
from zlib import crc32

CODES = {int: 'q', float: 'd', bool: '?'}
CHECKSUM = Struct('<I')


class DamagedError(ValueError):
    """A journal that was changed after it was written; the message says where."""


class JournalCodec:
    """
    Writes tuples of numbers as bytes, and reads them back.

    A record is the index of its kind (1 byte), its fields (8 bytes a number, 1 a bool) and a
    CRC-32 of them and of all records before. A change, a gap and another order are all detected.

    Parameters
    ----------
    kinds: the NamedTuples that can be written.
    seed: bytes that the first checksum begins with.

    """

    def __init__(self, kinds: Sequence[type[Any]], seed: bytes) -> None:
        self._kinds, self._sum = kinds, crc32(seed)
        self._structs = [
            Struct('<B' + ''.join(CODES[hint] for hint in get_type_hints(kind).values()))
            for kind in kinds]
        self._packers = {kind: (index, struct.pack)
                         for index, (kind, struct) in enumerate(zip(kinds, self._structs))}

    def pack(self, entry: tuple[Any, ...]) -> bytes:
        """Return the bytes of the next record."""
        index, pack = self._packers[type(entry)]
        content = pack(index, *entry)
        self._sum = crc32(content, self._sum)
        return content + CHECKSUM.pack(self._sum)

    def unpack(self, content: bytes) -> tuple[list[Any], int]:
        """
        Return the tuples in bytes, and how many of the bytes they take: up to the last whole one.

        A kill or a loss of power can leave part of a record at the end, zeros, or both; that is
        left out.

        Raises
        ------
        DamagedError: if a whole record does not match its checksum.

        """
        entries: list[Any] = []
        start, nonzero_size = 0, len(content.rstrip(b'\0'))
        while start < len(content):
            index = content[start]
            if index >= len(self._kinds):
                raise DamagedError(f'there is no record of kind {index}, at byte {start}')
            struct = self._structs[index]
            stop = start + struct.size
            if len(content) < stop + CHECKSUM.size:
                break
            expected = crc32(content[start:stop], self._sum)
            if expected != CHECKSUM.unpack_from(content, stop)[0]:
                if nonzero_size < stop + CHECKSUM.size:
                    break
                raise DamagedError(f'record {len(entries) + 1} at byte {start} does not match '
                                   'its checksum')
            entries.append(self._kinds[index](*struct.unpack_from(content, start)[1:]))
            self._sum = expected
            start = stop + CHECKSUM.size
        return entries, start
