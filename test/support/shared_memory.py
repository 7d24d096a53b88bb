# SPDX-License-Identifier: Apache-2.0
"""What killed nodes leave in shared memory: Fast DDS has a tool for it, `fastdds shm clean`."""

import fcntl
from pathlib import Path
import re
import time

MEMORY = Path('/dev/shm')
OLD = 60.0  # seconds; something younger may not have its lock yet


def clear(domain):
    """Delete the ports of a ROS domain that nobody else is in, and all that has no owner."""
    for path in (*MEMORY.glob('fastdds_port*'), *MEMORY.glob('sem.fastdds_port*')):
        name = re.search(r'fastdds_port(\d+)', path.name)
        if 7400 + 250 * domain <= int(name[1]) < 7650 + 250 * domain or is_left(name[0]):
            path.unlink(missing_ok=True)
    for path in MEMORY.glob('fastdds_' + '[0-9a-f]' * 16 + '*'):
        if is_left(path.name[:24]):
            path.unlink(missing_ok=True)


def is_left(name):
    """Tell whether the process that made a segment or port is gone: it locks a file beside it."""
    lock = MEMORY / f'{name}_el'
    try:
        if time.time() - (MEMORY / name).stat().st_mtime < OLD:
            return False
        with lock.open('rb') as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except (BlockingIOError, FileNotFoundError):
        return False
    return True
