# SPDX-License-Identifier: Apache-2.0
"""How many cores this process may use: fewer than the machine has under Slurm or in Docker."""

from contextlib import suppress
from math import ceil
import os
from pathlib import Path


def available_cores(root: Path = Path('/')) -> int:
    """
    Cores that this process may use: by its affinity (`taskset`), and by the quotas of its cgroups.

    root: folder that has `proc/self/cgroup` and `sys/fs/cgroup`.
    """
    quotas = [quota for folder in _cgroups(root)
              if (quota := _quota_v2(folder) or _quota_v1(folder))]
    return max(1, ceil(min([len(os.sched_getaffinity(0)), *quotas])))


def _cgroups(root: Path) -> list[Path]:
    """Return the folders of the cgroups that limit the time of this process, and their parents."""
    try:
        lines = (root / 'proc/self/cgroup').read_text().splitlines()
    except OSError:
        return []
    folders = []
    for _, controllers, path in (line.split(':', 2) for line in lines):
        if controllers and 'cpu' not in controllers.split(','):
            continue
        top = root / 'sys/fs/cgroup' / ('cpu' if controllers else '')
        below = Path(path.strip('/'))  # in a container, it need not exist
        folders += [top / each for each in (below, *below.parents)]
    return folders


def _quota_v2(folder: Path) -> float | None:
    with suppress(OSError, ValueError):
        quota, period = (folder / 'cpu.max').read_text().split()
        return int(quota) / int(period)  # `max` is no number: there is no limit
    return None


def _quota_v1(folder: Path) -> float | None:
    with suppress(OSError, ValueError):
        quota = int((folder / 'cpu.cfs_quota_us').read_text())
        return quota / int((folder / 'cpu.cfs_period_us').read_text()) if quota > 0 else None
    return None
