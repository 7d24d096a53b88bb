# SPDX-License-Identifier: Apache-2.0
"""A checkpoint as bytes: facts and arrays, after their versions and a checksum over all of it."""

from collections.abc import Mapping
import hashlib
import io
import json
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comply_ros.storage.versions import ALGORITHM_VERSION, FORMAT_VERSION

HEADER = 'comply_ros checkpoint, format {}, algorithm {}'
HEADER_PATTERN = re.compile(HEADER.format(*2 * [r'(\d{1,9})']).encode())


class CheckpointError(ValueError):
    """Bytes that are no checkpoint of this version; the message says what is wrong with them."""


def pack_checkpoint(facts: Mapping[str, Any], arrays: Mapping[str, Any]) -> tuple[str, bytes]:
    """Return digest (hex) and bytes of a table that JSON can write, and of arrays by name."""
    text = np.frombuffer(json.dumps(facts).encode(), dtype=np.uint8)
    file = io.BytesIO()
    np.savez(file, facts=text, **arrays)
    content = file.getbuffer()
    digest = hashlib.sha256(content).hexdigest()
    header = HEADER.format(FORMAT_VERSION, ALGORITHM_VERSION)
    return digest, b''.join((f'{header}\n{digest}\n'.encode(), content))


def unpack_checkpoint(content: bytes) -> tuple[str, dict[str, Any], dict[str, NDArray[Any]]]:
    """
    Return digest, facts and arrays.

    Raises
    ------
    CheckpointError: for anything but the bytes of a checkpoint of this version, to the last bit.

    """
    header, _, rest = content.partition(b'\n')
    versions = HEADER_PATTERN.fullmatch(header)
    if not versions:
        raise CheckpointError(f'must begin with {HEADER.partition(",")[0]!r} and its versions, '
                              f'got {header[:60]!r}')
    written_format, algorithm = map(int, versions.groups())
    if written_format != FORMAT_VERSION:
        raise CheckpointError(version_problem('format', written_format, FORMAT_VERSION))
    if algorithm != ALGORITHM_VERSION:
        raise CheckpointError(version_problem('algorithm', algorithm, ALGORITHM_VERSION)
                              + ', so its bits would differ')
    digest, _, rest = rest.partition(b'\n')
    if hashlib.sha256(rest).hexdigest().encode() != digest:
        raise CheckpointError('must be as it was written, but does not match its checksum')
    with np.load(io.BytesIO(rest), allow_pickle=False) as file:
        arrays = dict(file)
    return digest.decode(), json.loads(arrays.pop('facts').tobytes()), arrays


def version_problem(name: str, written: int, own: int) -> str:
    """Words for what was written with another format or algorithm version than our own."""
    age = 'an older' if written < own else 'a newer'
    return (f'was written by {age} version of comply_ros ({name} {written}; '
            f'this one reads {name} {own})')
