# SPDX-License-Identifier: Apache-2.0
"""The digests in golden_digests.json, and what to do where one differs."""

import json
from pathlib import Path
from typing import Any

CHANGED = ('what {} computes has other bits than before. If that is not what you want, a change '
           'went wrong. If it is, raise ALGORITHM_VERSION in comply_ros/storage/versions.py, so '
           'that no state, mentor or result of the old bits is read, and put the new digest into '
           'test/golden_digests.json: {}')


def golden_digests(part: str) -> Any:
    """Return a part of the file: `trainings`, `budgets`, `mentors`, `tables` or `lesson`."""
    return json.loads((Path(__file__).parents[1] / 'golden_digests.json').read_text())[part]
