# SPDX-License-Identifier: Apache-2.0
"""What killed nodes leave in shared memory: Fast DDS has a tool for it, `fastdds shm clean`."""

import fcntl
import os
from pathlib import Path
import re
import time

MEMORY = Path('/dev/shm')
OLD = 60.0  # seconds; a younger segment may not have its lock yet


def clear(domain):
    """Delete the ports of a ROS domain that nobody else is in, and segments without an owner."""
    for path in MEMORY.glob('*fastdds_port*'):
        port = int(re.search(r'port(\d+)', path.name)[1])
        if 7400 + 250 * domain <= port < 7650 + 250 * domain:
            path.unlink(missing_ok=True)
    for lock in MEMORY.glob('fastdds_????????????????_el'):
        if not is_held(lock) and time.time() - lock.stat().st_mtime > OLD:
            lock.with_name(lock.name.removesuffix('_el')).unlink(missing_ok=True)
            lock.unlink(missing_ok=True)


def is_held(lock):
    """Tell whether the process that made a segment lives: it locks a file beside it."""
    file = os.open(lock, os.O_RDWR)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(file)
    return False
