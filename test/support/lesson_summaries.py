# SPDX-License-Identifier: Apache-2.0
"""The summaries of `train` and of `lesson`, which differ in nothing but the clock."""

import json

from node_processes import run
from waiting import DEADLINE

from comply_ros.experiments import train


def trained_summary(folder, *argv):
    """Return the summary of `train`."""
    assert train.main(['train', *argv, '--out', str(folder)]) == 0
    return json.loads((folder / 'summary.json').read_text())


def lesson_summary(folder, *argv, timeout=DEADLINE):
    """Return the summary of `lesson`."""
    done = run('lesson', *argv, '--out', str(folder), timeout=timeout)
    assert done.returncode == 0, done.stderr
    assert 'Traceback' not in done.stderr
    return json.loads((folder / 'summary.json').read_text())


def assert_equal_but_for_time(one, other):
    """Check that two summaries differ in nothing but the clock."""
    for key in one:
        if key not in ('wall_seconds', 'steps_per_second'):
            assert one[key] == other[key], key
