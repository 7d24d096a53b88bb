# SPDX-License-Identifier: Apache-2.0
"""A state as bytes: facts and arrays, under a checksum over all of it."""

import hashlib
import io
import json

import numpy as np

MAGIC = b'comply_ros snapshot 1\n'


class SnapshotError(ValueError):
    """Bytes that are no snapshot; the message says what is wrong with them."""


def pack_snapshot(facts, arrays):
    """Return digest (hex) and bytes of a table that JSON can write, and of arrays by name."""
    text = np.frombuffer(json.dumps(facts).encode(), dtype=np.uint8)
    file = io.BytesIO()
    np.savez(file, facts=text, **arrays)
    content = file.getbuffer()
    digest = hashlib.sha256(content).hexdigest()
    return digest, b''.join((MAGIC, digest.encode(), b'\n', content))


def unpack_snapshot(content):
    """
    Return digest, facts and arrays.

    Raises
    ------
    SnapshotError: for anything but the bytes of a snapshot, to the last bit.

    """
    if not content.startswith(MAGIC):
        raise SnapshotError(f'must begin with {MAGIC.decode().strip()!r}, '
                            f'got {content[:len(MAGIC)]!r}')
    digest, _, rest = content[len(MAGIC):].partition(b'\n')
    if hashlib.sha256(rest).hexdigest().encode() != digest:
        raise SnapshotError('must be as it was written, and does not fit its checksum')
    with np.load(io.BytesIO(rest), allow_pickle=False) as arrays:
        arrays = dict(arrays)
    return digest.decode(), json.loads(arrays.pop('facts').tobytes()), arrays
